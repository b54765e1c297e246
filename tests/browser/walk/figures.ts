// SPDX-License-Identifier: Apache-2.0
// How late and how often pictures are seen, told by the test's own clock.
import type {Page} from 'playwright-core';

import {until} from '../support/chromium';

interface Seen {
  seen: number;      // pictures
  rates: number[];   // pictures a second, of each camera
  late: number[];    // ms from a picture's arrival at the daemon to the screen, the least first
  known_ms: number;  // half the width in which the page's clock against the daemon's lies
}

/** Of `many` pictures of each of so many cameras. */
export async function frameToScreen(page: Page, cameras: number, many: number): Promise<Seen> {
  // Both clocks are this machine's: one question tells how the page's stands against the daemon's.
  let least = Infinity;
  let offset = 0;
  for (let i = 0; i < 30; ++i) {
    const before = Number(process.hrtime.bigint()) / 1e6;
    const at = await page.evaluate(() => performance.now());
    const after = Number(process.hrtime.bigint()) / 1e6;
    if (after - before >= least) continue;
    least = after - before;
    offset = (before + after) / 2 - at;
  }
  const from = await page.evaluate(() => performance.now());
  const seen = new Map<string, Map<number, number>>();  // of each camera: when a picture came, and when it was seen
  const read = async () => {
    const newest = await page.evaluate(() => [...window.emberlockDiagnostics.shown].map(([id, list]) => ({id, list: list.map(({at, monotonic_ns}) => [monotonic_ns / 1e6, at] as const)})));
    for (const {id, list} of newest) {
      const times = seen.get(id) ?? new Map<number, number>();
      seen.set(id, times);
      for (const [came, at] of list) if (at >= from) times.set(came, at);
    }
    return [...seen.values()].map(times => times.size);
  };
  await until(read, sizes => sizes.length === cameras && Math.min(...sizes) >= many, `${many} pictures of each camera`);
  const lists = [...seen.values()].map(times => [...times].map(([came, at]) => ({came, at})));
  return {
    seen: lists.flat().length,
    rates: lists.map(list => (1000 * (list.length - 1)) / (list.at(-1)!.at - list[0]!.at)),
    late: lists.flat().map(({at, came}) => at + offset - came).sort((a, b) => a - b),
    known_ms: least / 2,
  };
}
