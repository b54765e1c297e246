// SPDX-License-Identifier: Apache-2.0
// What can be shown of a frame, and the controls of how: range, opacity and its curve, isotherms.
import {el, set, setText, show} from '../dom';
import type {Frame, Values} from './contents';
import type {Look} from './march';
import {words} from './slices';
import {Transfer} from './transfer';

const kNames: Record<string, string> = {
  emission: 'Colour', density: 'Extinction', temperature: 'Temperature', temperature_sigma: 'Error of the temperature',
  emission_sigma: 'Error of the light', density_sigma: 'Error of the extinction',
};

/** One value a point; of three the largest. */
export function single(values: Float32Array, lanes: 1 | 3): Float32Array {
  return lanes === 1 ? values : Float32Array.from({length: values.length / 3}, (_, p) => Math.max(values[3 * p]!, values[3 * p + 1]!, values[3 * p + 2]!));
}

/** Where all but a hundredth of what is told lies at either end: few stray values don't set the colours. */
export function usualRange(values: Float32Array): [number, number] {
  const told = values.filter(value => value > 0).sort();
  if (told.length === 0) return [0, 1];
  const at = (share: number) => told[Math.min(told.length - 1, Math.floor(share * told.length))]!;
  const [low, high] = [at(0.01), at(0.99)];
  return high > low ? [low, high] : [0, high];
}

const kSteps = 400;
const kMostLevels = 4;

export class Quantities {
  private readonly select = el('select', {'aria-label': 'What is shown', onchange: () => this.choose(this.select.value)});
  private readonly knob = (name: string, value: number, min = 0, max = kSteps) =>
    el('input', {type: 'range', min, max, step: 1, value, 'aria-label': name, oninput: () => this.turned()});
  private readonly gain = this.knob('Brightness', 0, -40, 80);
  private readonly low = this.knob('Lowest value in colour', 0);
  private readonly high = this.knob('Highest value in colour', kSteps);
  private readonly depth = this.knob('Opacity', 200);
  private readonly count = this.knob('How many isotherms', 0, 0, kMostLevels);
  readonly transfer = new Transfer(() => this.changed(false));
  private readonly said = new Map<HTMLInputElement, HTMLElement>();
  private readonly ofColour: HTMLElement;
  private readonly ofQuantity: HTMLElement;
  private readonly bar = {low: el('span', {class: 'low'}), high: el('span', {class: 'high'})};
  private ends: readonly [number, number] = [0, 1];  // of the sliders
  private unit = '';
  readonly root: HTMLElement;

  constructor(private readonly changed: (again: boolean) => void) {
    const row = (label: string, input: HTMLInputElement) => {
      const value = el('output');
      this.said.set(input, value);
      return el('label', {}, `${label} `, value, input);
    };
    this.ofColour = el('div', {class: 'knobs'}, row('Brightness', this.gain));
    this.ofQuantity = el('div', {class: 'knobs'},
      el('p', {class: 'colour-bar'}, this.bar.low, el('span', {class: 'colours', role: 'img', 'aria-label': 'from dark to bright'}), this.bar.high),
      this.transfer.root, row('From', this.low), row('To', this.high), row('Opacity', this.depth), row('Isotherms', this.count));
    this.root = el('div', {class: 'knobs'}, el('label', {}, 'Show ', this.select), this.ofColour, this.ofQuantity);
  }

  get chosen(): string {
    return this.select.value;
  }

  /** Of this frame; what was chosen stays where there is such a channel. */
  offer(frame: Frame): void {
    const options = Object.keys(kNames).filter(name => frame.channels.some(channel => channel.name === name));
    const before = this.select.value;
    if (options.join() !== [...this.select.options].map(({value}) => value).join()) {
      this.select.replaceChildren(...options.map(value => el('option', {value}, kNames[value]!)));
    }
    this.select.value = options.includes(before) ? before : options[0] ?? '';
  }

  /** The sliders' ends by the first frame's values; later frames keep them, so that colours mean the same. */
  span(frame: Frame, values: Values): void {
    const channel = frame.channels.find(({name}) => name === this.chosen);
    if (!channel) return;
    this.unit = channel.unit;
    this.ends = usualRange(single(values.get(channel.name)!, channel.lanes));
    const [low, high] = this.ends;
    // Below the lowest there is room for what the sliders shall leave out.
    this.ends = [Math.max(0, low - 0.25 * (high - low)), high + 0.1 * (high - low)];
    const share = (value: number) => String(Math.round(kSteps * (value - this.ends[0]) / (this.ends[1] - this.ends[0])));
    this.low.value = share(low);
    this.high.value = share(high);
    this.tell();
  }

  private valueOf(input: HTMLInputElement): number {
    return this.ends[0] + (this.ends[1] - this.ends[0]) * input.valueAsNumber / kSteps;
  }

  get range(): [number, number] {
    return [this.valueOf(this.low), Math.max(this.valueOf(this.low), this.valueOf(this.high))];
  }

  /** Evenly between low and high. */
  get levels(): number[] {
    const [low, high] = this.range;
    const many = this.count.valueAsNumber;
    return Array.from({length: many}, (_, n) => low + (high - low) * (n + 1) / (many + 1));
  }

  get look(): Look {
    if (this.chosen === 'emission') return {mode: 'colour', gain: 2 ** (this.gain.valueAsNumber / 10)};
    const [low, high] = this.range;
    return {mode: 'quantity', low, high, depth: this.depth.valueAsNumber === 0 ? 0 : 0.1 * 10 ** (this.depth.valueAsNumber / 100), levels: this.levels};
  }

  private choose(name: string): void {
    this.select.value = name;
    this.changed(true);
  }

  private turned(): void {
    this.tell();
    this.changed(false);
  }

  tell(): void {
    const colour = this.chosen === 'emission';
    show(this.ofColour, colour);
    show(this.ofQuantity, !colour);
    const [low, high] = this.range;
    const levels = this.levels.map(level => words(level, this.unit)).join(', ');
    const look = this.look;
    for (const [input, text] of [[this.gain, `${(2 ** (this.gain.valueAsNumber / 10)).toFixed(2)} times`], [this.low, words(low, this.unit)], [this.high, words(high, this.unit)],
                                 [this.depth, look.mode === 'quantity' && look.depth > 0 ? `depth ${look.depth.toPrecision(2)}` : 'none'], [this.count, levels || 'none']] as const) {
      setText(this.said.get(input)!, text);
      set(input, 'aria-valuetext', text);
    }
    setText(this.bar.low, words(low, this.unit));
    setText(this.bar.high, words(high, this.unit));
  }
}
