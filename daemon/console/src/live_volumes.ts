// SPDX-License-Identifier: Apache-2.0
// Volumes of a recording's newest frames, while it goes on: what is asked for with a recording, and what is told of them.
import type {DaemonStatus, Light, LiveRequest, LiveStatus} from './api.gen';
import {el, set, setText, show} from './dom';
import {count, fixed, known} from './format';
import {showSign, type Sign} from './light';

const states: Record<LiveStatus['state'], [Light, string]> = {
  STATE_UNSPECIFIED: ['LIGHT_UNSPECIFIED', ''],
  STARTING: ['GREEN', 'live, no volume yet'],
  RUNNING: ['GREEN', 'live'],
  PAUSED: ['AMBER', 'live, paused'],
  STOPPED: ['AMBER', 'live, stopped'],
  ENDED: ['GREEN', 'was live'],
  FAILED: ['AMBER', 'live, failed'],
};

/** Whether the recording that goes on has them. */
export function films({phase, live, recording}: DaemonStatus): boolean {
  return live !== undefined && phase === 'CAPTURING' && live.session === recording?.session;
}

/** How old the newest volume's frame is: "frame 120, 0.9 s ago". */
export function age(live: LiveStatus, now_ns: number, goesOn: boolean): string {
  if (!known(live.frame)) return '';
  const seconds = goesOn ? 1e-9 * (now_ns - live.filmed_ns) : live.delay_s;
  return `frame ${live.frame}, ${fixed(Math.max(seconds, 0), 1)} s ${goesOn ? 'ago' : 'after it was filmed'}`;
}

/** What they take, and what was left out. */
export function effort(live: LiveStatus): string {
  return [known(live.frame) && `${fixed(live.takes_s, 2)} s a volume of ${live.voxels} voxels`, live.device && `on ${live.device}`,
          live.volumes + live.skipped > 0 && `${count(live.volumes)} shown, ${count(live.skipped)} skipped (they are recorded)`].filter(Boolean).join(' · ');
}

/** What a recording is asked for. */
export class LiveChoice {
  private readonly on = el('input', {name: 'live', type: 'checkbox'});
  private readonly every = el('input', {name: 'live-every', type: 'number', min: 1, max: 1e6, step: 1, placeholder: 'the newest', inputmode: 'numeric'});
  private readonly voxels = el('input', {name: 'live-voxels', type: 'number', min: 8, max: 1024, step: 1, placeholder: 'by the machine', inputmode: 'numeric'});
  private readonly further: HTMLElement[];
  readonly options: HTMLElement[];

  constructor() {
    const option = (label: string, input: HTMLElement) => el('label', {}, el('span', {}, label), input);
    this.further = [option('Each frame of so many', this.every), option('Voxels', this.voxels)];
    this.options = [option('Live volumes', this.on), ...this.further];
    this.on.addEventListener('change', () => this.shown());
    this.shown();
  }

  /** Undefined where a number is out of range, which the browser then says. */
  request(): {live?: LiveRequest} | undefined {
    if (!this.on.checked) return {};
    for (const input of [this.every, this.voxels]) {
      if (input.checkValidity()) continue;
      input.closest('details')!.open = true;
      input.reportValidity();
      return undefined;
    }
    return {live: {every: this.every.valueAsNumber || 0, voxels: this.voxels.valueAsNumber || 0}};
  }

  private shown(): void {
    for (const part of this.further) show(part, this.on.checked);
  }
}

/** What is told beside the volume. */
export class LiveLine {
  private readonly age = el('p', {class: 'live-age'});
  private readonly effort = el('p', {class: 'live-effort'});
  private readonly reason = el('p', {class: 'live-reason', role: 'status'});
  readonly root = el('div', {class: 'live-volumes', hidden: true}, this.age, this.effort, this.reason);

  show(status: DaemonStatus, live: LiveStatus, sign: Sign, word: HTMLElement): void {
    const [light, words] = live.state === 'RUNNING' && !live.keeps_up ? ['AMBER', 'live, does not keep up'] as const : states[live.state];
    showSign(sign, word, light, words);
    setText(this.age, age(live, status.now_ns, films(status)));
    set(this.age, 'data-frame', live.frame);
    setText(this.effort, effort(live));
    setText(this.reason, live.reason);
    show(this.reason, live.reason !== '');
  }
}
