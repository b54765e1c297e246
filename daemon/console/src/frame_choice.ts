// SPDX-License-Identifier: Apache-2.0
// Which frame of a session is reconstructed: the middle one, or the one that is named.
import type {ListSessionsResponse_Entry as Entry} from './api.gen';
import {el, set} from './dom';
import {count} from './format';

/** Frames that every camera has about as many of. */
export function framesEach(entry: Entry): number {
  return entry.cameras > 0 ? Math.floor(entry.frames / entry.cameras) : 0;
}

export class FrameChoice {
  private readonly input: HTMLInputElement;
  readonly root: HTMLElement;

  constructor(session: string) {
    this.input = el('input', {type: 'number', min: 0, step: 1, placeholder: 'middle', inputmode: 'numeric', 'aria-label': `Frame of ${session} to reconstruct`});
    this.root = el('span', {class: 'frame-choice'}, el('span', {'aria-hidden': 'true'}, 'frame'), this.input);
  }

  show(entry: Entry, disabled: boolean): void {
    const last = Math.max(0, framesEach(entry) - 1);
    set(this.input, 'max', last);
    set(this.input, 'title', `0 to ${count(last)}; empty: the middle one`);
    this.input.disabled = disabled;
  }

  /** The request's part, or undefined where there is no such frame, which the browser says. */
  request(): {frame?: number} | undefined {
    if (!this.input.reportValidity()) return undefined;
    return this.input.value === '' ? {} : {frame: this.input.valueAsNumber};
  }
}
