// SPDX-License-Identifier: Apache-2.0
// How late and how often pictures are seen. Measured when the browser goes on to the next frame after the one that drew them.
import type {Picture} from './wire';

const kWindow = 5000;         // ms over which rates are counted
const kClockWindow = 60_000;  // ms over which the quickest status tells the clocks' difference

interface Shown {
  at: number;         // ms on the page's clock
  monotonic_ns: number;
  latency?: number;   // ms, from its arrival at the daemon; once the daemon's clock is known
}

export interface Summary {
  cameras: number;
  fps_min: number;
  fps_mean: number;
  latency_median_ms: number;
  latency_p95_ms: number;
}

export class Diagnostics {
  readonly shown = new Map<string, Shown[]>();
  /** Pictures that came but were overtaken before they were decoded, or couldn't be. */
  overtaken = 0;
  damaged = 0;
  private clock: {at: number; offset: number}[] = [];

  /** The daemon's clock read `now_ns` some time before now: the least such difference is nearest to the truth. */
  heard(now_ns: number): void {
    const at = performance.now();
    this.clock = this.clock.filter(sample => at - sample.at < kClockWindow);
    this.clock.push({at, offset: now_ns / 1e6 - at});
  }

  /** After another connection the daemon may be another one. */
  forget(): void {
    this.clock = [];
  }

  seen(pictures: Picture[]): void {
    const at = performance.now();
    const offset = this.clock.length > 0 ? Math.max(...this.clock.map(sample => sample.offset)) : undefined;
    for (const {camera_id, monotonic_ns} of pictures) {
      const list = this.shown.get(camera_id) ?? [];
      this.shown.set(camera_id, list);
      // Nothing is shown before it came: below 0 it is the clocks that aren't known better.
      list.push({at, monotonic_ns, latency: offset === undefined ? undefined : Math.max(0, at + offset - monotonic_ns / 1e6)});
      while (at - list[0]!.at > kWindow) list.shift();
    }
  }

  summary(): Summary {
    const now = performance.now();
    const fps: number[] = [];
    const latencies: number[] = [];
    for (const list of this.shown.values()) {
      const recent = list.filter(item => now - item.at < kWindow);
      if (recent.length < 2) continue;
      fps.push((1000 * (recent.length - 1)) / (recent.at(-1)!.at - recent[0]!.at));
      for (const item of recent) if (item.latency !== undefined) latencies.push(item.latency);
    }
    latencies.sort((a, b) => a - b);
    const quantile = (q: number) => latencies[Math.min(latencies.length - 1, Math.floor(q * latencies.length))] ?? NaN;
    return {
      cameras: fps.length,
      fps_min: Math.min(...fps),
      fps_mean: fps.reduce((sum, value) => sum + value, 0) / fps.length,
      latency_median_ms: quantile(0.5),
      latency_p95_ms: quantile(0.95),
    };
  }
}

export const diagnostics = new Diagnostics();

declare global {
  interface Window { emberlockDiagnostics: Diagnostics }
}
if (typeof window !== 'undefined') window.emberlockDiagnostics = diagnostics;
