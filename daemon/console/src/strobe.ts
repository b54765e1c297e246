// SPDX-License-Identifier: Apache-2.0
// The strobe: what it is asked for, and what it read back.
import type {DaemonStatus, StrobeState, StrobeState_Output, StrobeStatus} from './api.gen';
import {act} from './act';
import {el, set, setText, show} from './dom';
import {fixed, short} from './format';
import {showSign, Sign} from './light';
import {call} from './wire';

const outputs: [StrobeState_Output, string][] = [['OFF', 'Off'], ['FLASHING', 'Flashing'], ['STEADY', 'Steady light']];

/** "23.976 Hz, phase 0 µs, width 20 µs, flashing". */
export function strobeWords(s: StrobeState): string {
  const output = outputs.find(([value]) => value === s.output)?.[1].toLowerCase() ?? 'unknown';
  if (s.output !== 'FLASHING') return output;
  const flashes = s.code.filter(Boolean).length;
  const code = flashes === s.code.length ? output : flashes === 0 ? 'held dark' : `${output} ${flashes} of ${s.code.length} times`;
  return `${fixed(s.rate_hz, 3)} Hz, phase ${short(s.phase_s)}, width ${short(s.width_s)}, ${code}`;
}

/** Of a strobe that somebody sets by hand: what to set, and what it was seen to do. */
function dialWords(strobe: StrobeStatus): string {
  const rate = (hz: number) => `${fixed(hz * 60, 1)} a minute (${fixed(hz, 3)} Hz)`;
  const set = strobe.settings?.output === 'FLASHING' ? `To set: ${rate(strobe.settings.rate_hz)}` : '';
  return [set, strobe.measured_hz > 0 ? `measured: ${rate(strobe.measured_hz)}` : ''].filter(Boolean).join(', ');
}

export class Strobe {
  private readonly sign = new Sign();
  private readonly word = el('span', {class: 'word'});
  private readonly readBack = el('p', {class: 'read-back', role: 'status'});
  private readonly reason = el('p', {class: 'reason'});
  private readonly rate = this.number('strobe-rate');
  private readonly phase = this.number('strobe-phase');
  private readonly width = this.number('strobe-width');
  private readonly outputs = outputs.map(([value]) => el('input', {type: 'radio', name: 'output', value, id: `strobe-${value}`, oninput: () => { this.dirty = true; }}));
  private readonly apply = el('button', {class: 'primary', type: 'submit'}, 'Apply');
  private readonly why = el('p', {class: 'note'});
  private readonly form: HTMLFormElement;
  private dirty = false;  // somebody types: what is read back doesn't overwrite it
  private code: boolean[] = [];
  readonly root: HTMLElement;

  constructor() {
    const row = (label: string, unit: string, input: HTMLInputElement) => el('label', {}, el('span', {}, `${label}, ${unit}`), input);
    this.form = el('form', {class: 'strobe', onsubmit: (event: Event) => { event.preventDefault(); void this.send(); }},
      el('div', {class: 'choice', role: 'radiogroup', 'aria-label': 'Output'},
        ...outputs.flatMap(([value, words], place) => [this.outputs[place]!, el('label', {for: `strobe-${value}`}, words)])),
      row('Rate', 'Hz', this.rate), row('Phase', 'ms', this.phase), row('Width', 'µs', this.width), this.apply);
    this.root = el('section', {id: 'strobe', class: 'panel', 'aria-labelledby': 'strobe-title'},
      el('header', {}, this.sign.root, el('h2', {id: 'strobe-title'}, 'Strobe'), this.word), this.readBack, this.reason, this.form, this.why);
  }

  show(status: DaemonStatus): void {
    const strobe = status.strobe;
    const there = strobe !== undefined && strobe.id !== '';
    const byHand = there && strobe.by_hand;
    show(this.form, there && !byHand);
    showSign(this.sign, this.word, strobe?.light ?? 'LIGHT_UNSPECIFIED', there ? strobe.id : 'none');
    setText(this.readBack, byHand ? dialWords(strobe) : there && strobe.settings ? `Reads back: ${strobeWords(strobe.settings)}` : '');
    setText(this.reason, there ? strobe.reason : 'The rig has no strobe: cameras can be recorded, not aligned.');
    if (there && strobe.settings && !this.dirty) this.fill(strobe.settings);
    const busy = status.phase !== 'IDLE' && status.phase !== 'PHASE_UNSPECIFIED';
    for (const control of [this.apply, this.rate, this.phase, this.width, ...this.outputs]) control.disabled = busy;
    set(this.form, 'data-busy', busy);
    setText(this.why, there && busy && !byHand ? 'In use. Stop the alignment to set it by hand.' : '');
  }

  private fill(s: StrobeState): void {
    this.code = s.code;
    const put = (input: HTMLInputElement, value: number, digits: number) => { if (document.activeElement !== input) input.value = String(Number(value.toFixed(digits))); };
    put(this.rate, s.rate_hz, 4);
    put(this.phase, s.phase_s * 1e3, 3);
    put(this.width, s.width_s * 1e6, 1);
    for (const input of this.outputs) input.checked = input.value === s.output;
  }

  private async send(): Promise<void> {
    const output = this.outputs.find(input => input.checked)?.value as StrobeState_Output | undefined;
    this.apply.disabled = true;
    const answer = await act(call('Strobe/Apply', {
      output: output ?? 'OFF',
      rate_hz: this.rate.valueAsNumber || 0,
      phase_s: (this.phase.valueAsNumber || 0) / 1e3,
      width_s: (this.width.valueAsNumber || 0) / 1e6,
      code: this.code,
    }));
    this.apply.disabled = false;
    if (!answer) return;
    this.dirty = false;
    this.fill(answer);
    setText(this.readBack, `Reads back: ${strobeWords(answer)}`);
  }

  private number(id: string): HTMLInputElement {
    return el('input', {type: 'number', id, step: 'any', min: 0, inputmode: 'decimal', oninput: () => { this.dirty = true; }});
  }
}
