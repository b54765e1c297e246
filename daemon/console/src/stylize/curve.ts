// SPDX-License-Identifier: Apache-2.0
// A colour for each temperature, as a curve of a few stops, between which it changes evenly.
import {el, show} from '../dom';
import {NumberField, order, valid} from './fields';
import type {Bench, Tool} from './tool';

const kMost = 64;  // stops, as the daemon takes them
const kBegin: [number, string][] = [[1300, '#0030ff'], [1800, '#00c8ff'], [2300, '#ffffff']];

class Stop {
  readonly kelvin: NumberField;
  readonly colour: HTMLInputElement;
  readonly gain: NumberField;
  readonly root: HTMLElement;

  constructor(kelvin: number, colour: string, gain: number, changed: () => void, remove: (stop: Stop) => void) {
    this.kelvin = new NumberField('at', kelvin, {min: 1, max: 100000}, 'K', changed);
    this.colour = el('input', {type: 'color', value: colour, 'aria-label': 'Colour of the stop', oninput: changed});
    this.gain = new NumberField('gain', gain, {min: 0, max: 10000});
    this.root = el('li', {}, this.kelvin.root, this.colour, this.gain.root,
      el('button', {type: 'button', class: 'quiet', 'aria-label': 'Remove the stop', onclick: () => remove(this)}, '✕'));
  }

  get rgb(): [number, number, number] {
    return [1, 3, 5].map(at => parseInt(this.colour.value.slice(at, at + 2), 16)) as [number, number, number];
  }
}

export class Curve implements Tool {
  readonly name = 'Colour';
  readonly hint = 'The flame\'s colour at each temperature: evenly between two stops, and beyond the last as there.';
  private stops: Stop[] = [];
  private readonly list = el('ol', {class: 'stops'});
  private readonly bar = el('div', {class: 'curve-bar', 'aria-hidden': 'true'});
  private readonly more = order('Add a stop', () => this.add(), 'quiet');
  readonly root = el('div', {}, this.bar, this.list, el('div', {class: 'tool-orders'}, this.more, order('Set colours', () => this.apply(), 'primary')));

  constructor(private readonly bench: Bench) {
    for (const [kelvin, colour] of kBegin) this.put(kelvin, colour);
    this.changed();
  }

  changed(): void {
    const sorted = [...this.stops].sort((a, b) => a.kelvin.value - b.kelvin.value);
    const [low, high] = [sorted[0]!.kelvin.value, sorted.at(-1)!.kelvin.value];
    const stops = sorted.map(stop => `${stop.colour.value} ${high > low ? 100 * (stop.kelvin.value - low) / (high - low) : 0}%`);
    this.bar.style.background = `linear-gradient(to right, ${stops.join(', ')}, ${sorted.at(-1)!.colour.value})`;
    for (const stop of this.stops) show(stop.root.lastElementChild!, this.stops.length > 1);
    this.more.disabled = this.stops.length >= kMost;
  }

  private put(kelvin: number, colour: string): void {
    const stop = new Stop(kelvin, colour, 1, () => this.changed(), gone => {
      this.stops = this.stops.filter(other => other !== gone);
      gone.root.remove();
      this.changed();
    });
    this.stops.push(stop);
    this.list.append(stop.root);
  }

  private add(): void {
    const last = this.stops.at(-1)!;
    this.put(last.kelvin.value + 200, last.colour.value);
    this.changed();
  }

  private apply(): void {
    if (!valid(...this.stops.flatMap(stop => [stop.kelvin, stop.gain]))) return;
    const sorted = [...this.stops].sort((a, b) => a.kelvin.value - b.kelvin.value);
    const curve = sorted.map(stop => ({kelvin: stop.kelvin.value, colour: stop.rgb, gain: stop.gain.value}));
    void this.bench.send({op: 'colour', curve});
  }
}
