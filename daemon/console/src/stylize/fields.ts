// SPDX-License-Identifier: Apache-2.0
// Labelled inputs of the tools.
import {el} from '../dom';

interface Range {
  min?: number;
  max?: number;
  step?: number;
}

export class NumberField {
  readonly input: HTMLInputElement;
  readonly root: HTMLElement;

  constructor(words: string, value: number | '', {min, max, step}: Range, unit = '', oninput?: () => void) {
    this.input = el('input', {type: 'number', value, min, max, step: step ?? 'any', required: true, inputmode: 'decimal', oninput});
    this.root = el('label', {class: 'field'}, el('span', {}, words), this.input, el('span', {class: 'unit'}, unit));
  }

  get value(): number {
    return this.input.valueAsNumber;
  }
  set value(value: number) {
    this.input.value = String(value);
  }
  /** False: it is no number in its range, which the browser says. */
  get valid(): boolean {
    return this.input.reportValidity();
  }
}

/** Whether all are; the browser says which isn't. */
export function valid(...fields: NumberField[]): boolean {
  return fields.every(field => field.valid);
}

export function choice(words: string, options: Record<string, string>, onchange?: () => void): {root: HTMLElement; select: HTMLSelectElement} {
  const select = el('select', {onchange}, ...Object.entries(options).map(([value, text]) => el('option', {value}, text)));
  return {root: el('label', {class: 'field'}, el('span', {}, words), select), select};
}

export function order(words: string, run: () => void, kind = ''): HTMLButtonElement {
  return el('button', {type: 'button', class: kind, onclick: run}, words);
}
