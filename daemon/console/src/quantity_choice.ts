// SPDX-License-Identifier: Apache-2.0
// What is reconstructed: colour, colour with its errors, or temperature too, and by which emitter and camera response that is read.
import type {ReconstructRequest, SpectralResponse} from './api.gen';
import {el, show} from './dom';

const kAbsoluteUnit = 'levels (0..255) per W / (sr m2)';

/** A response.json's text as the daemon takes it; undefined: it is none. */
export function responseOf(text: string): SpectralResponse | undefined {
  try {
    const {unit, wavelength_nm, r, g, b} = JSON.parse(text) as Record<string, unknown>;
    const numbers = (list: unknown): list is number[] => Array.isArray(list) && list.every(value => typeof value === 'number');
    if ((unit !== kAbsoluteUnit && unit !== 'relative') || !numbers(wavelength_nm) || !numbers(r) || !numbers(g) || !numbers(b)) return undefined;
    return {wavelength_nm, r, g, b, absolute: unit === kAbsoluteUnit};
  } catch {
    return undefined;
  }
}

function choice(label: string, options: Record<string, string>, onchange?: () => void): HTMLSelectElement {
  return el('select', {'aria-label': label, onchange}, ...Object.entries(options).map(([value, words]) => el('option', {value}, words)));
}

export class QuantityChoice {
  private readonly quantity: HTMLSelectElement;
  private readonly emitter: HTMLSelectElement;
  private readonly lines: HTMLSelectElement;
  private readonly response: HTMLInputElement;
  private readonly temperature: HTMLElement;
  readonly root: HTMLElement;

  constructor(session: string) {
    this.quantity = choice(`What of ${session} to reconstruct`, {colour: 'colour', errors: 'colour and its errors', temperature: 'temperature'},
                           () => show(this.temperature, this.quantity.value === 'temperature'));
    this.emitter = choice(`What glows in ${session}`, {'': 'grey or soot', grey: 'grey', soot: 'soot', paper: 'as in the paper'}, () => this.enableLines());
    this.lines = choice(`What shines beside it in ${session}`, {'': 'alone', auto: 'with lines, found out', sodium: 'with sodium', c2: 'with a blue base', 'sodium,c2': 'with both'});
    this.response = el('input', {type: 'file', accept: '.json,application/json', 'aria-label': `Camera response of ${session}`,
                                 title: 'A response.json of "calibrate colour --black-body"; without one the session’s is taken, else that of a camera that shows linear sRGB.'});
    const word = (text: string) => el('span', {'aria-hidden': 'true'}, text);
    this.temperature = el('span', {class: 'of-temperature', hidden: true}, word('of'), this.emitter, this.lines, word('response'), this.response);
    this.root = el('span', {class: 'quantity-choice'}, this.quantity, this.temperature);
  }

  enable(enabled: boolean): void {
    for (const input of [this.quantity, this.emitter, this.response]) input.disabled = !enabled;
    this.enableLines();
  }

  /** The paper reads green alone, which can't tell lines. */
  private get takesLines(): boolean {
    return this.emitter.value !== 'paper';
  }

  private enableLines(): void {
    this.lines.disabled = this.emitter.disabled || !this.takesLines;
  }

  /** The request's part; undefined where the file is no response, which the browser says. */
  async request(): Promise<Partial<ReconstructRequest> | undefined> {
    if (this.quantity.value === 'errors') return {errors: true};
    if (this.quantity.value !== 'temperature') return {};
    const file = this.response.files?.[0];
    // A file that has changed since it was chosen can't be read.
    const response = file && responseOf(await file.text().catch(() => ''));
    this.response.setCustomValidity('');
    if (file && !response) {
      this.response.setCustomValidity('This is no camera response, or it has changed: choose it again, a response.json of "calibrate colour --black-body".');
      this.response.reportValidity();
      return undefined;
    }
    const [emitter, lines] = [this.emitter.value, this.takesLines && this.lines.value];
    return {quantity: 'temperature', ...(emitter && {emitter}), ...(lines && {lines}), ...(response && {response})};
  }
}
