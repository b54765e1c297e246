// SPDX-License-Identifier: Apache-2.0
// Which frames of a session are reconstructed: the middle one, one that is named, or each from one to another.
import type {ListSessionsResponse_Entry as Entry, ReconstructRequest} from './api.gen';
import {el, set} from './dom';
import {count} from './format';

const kMost = 1000;  // as the daemon takes them

/** Frames that every camera has about as many of. */
export function framesEach(entry: Entry): number {
  return entry.cameras > 0 ? Math.floor(entry.frames / entry.cameras) : 0;
}

function number(min: number, placeholder: string, label: string): HTMLInputElement {
  return el('input', {type: 'number', min, step: 1, placeholder, inputmode: 'numeric', 'aria-label': label});
}

export class FrameChoice {
  private readonly first: HTMLInputElement;
  private readonly last: HTMLInputElement;
  private readonly every: HTMLInputElement;
  readonly root: HTMLElement;

  constructor(session: string) {
    this.first = number(0, 'middle', `Frame of ${session} to reconstruct`);
    this.last = number(0, 'alone', `Last frame of ${session} to reconstruct, of several`);
    this.every = number(1, '1', `Of ${session}, each frame of so many`);
    const word = (text: string) => el('span', {'aria-hidden': 'true'}, text);
    this.root = el('span', {class: 'frame-choice'}, word('frame'), this.first, word('to'), this.last, word('every'), this.every);
  }

  show(entry: Entry, disabled: boolean): void {
    const last = Math.max(0, framesEach(entry) - 1);
    for (const input of [this.first, this.last]) set(input, 'max', last);
    set(this.first, 'title', `0 to ${count(last)}; empty: the middle one`);
    set(this.last, 'title', `Up to ${count(last)}: one frame after the other; empty: one frame alone`);
    set(this.every, 'title', 'Of several frames each of so many');
    for (const input of [this.first, this.last, this.every]) input.disabled = disabled;
  }

  /** The request's part, or undefined where there are no such frames, which the browser says. */
  request(): Partial<ReconstructRequest> | undefined {
    const [first, last, every] = [this.first, this.last, this.every].map(input => (input.value === '' ? undefined : input.valueAsNumber));
    this.last.setCustomValidity('');
    this.every.setCustomValidity('');
    set(this.last, 'min', first ?? 0);
    if (last === undefined && every !== undefined) this.every.setCustomValidity('This is for several frames: name the last one, too.');
    else if (last !== undefined && first === undefined) this.last.setCustomValidity('Name the first frame, too.');
    else if (last !== undefined && Math.floor((last - first!) / (every || 1)) >= kMost) this.last.setCustomValidity(`Choose at most ${count(kMost)} frames.`);
    if (![this.first, this.last, this.every].every(input => input.reportValidity())) return undefined;
    return {...(first !== undefined && {frame: first}), ...(last !== undefined && {last_frame: last, every: every ?? 1})};
  }
}
