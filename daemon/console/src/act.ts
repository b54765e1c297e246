// SPDX-License-Identifier: Apache-2.0
// What an operator orders: carried out, and told when it fails; and orders that need a second press.
import {el, set, setText} from './dom';
import {sentence} from './format';
import {Sign} from './light';
import {ApiError} from './wire';

const toasts = el('div', {class: 'toasts', role: 'alert'});
export const toastArea = toasts;

/** Shows what went wrong until it is dismissed; at most four. */
export function complain(message: string): void {
  const toast = el('div', {class: 'toast'}, new Sign('RED').root, el('p', {}, sentence(message)),
    el('button', {'aria-label': 'Dismiss', onclick: () => toast.remove()}, '✕'));
  toasts.append(toast);
  while (toasts.children.length > 4) toasts.firstElementChild!.remove();
}

/** The order's answer, or undefined where it failed, which is told. */
export async function act<T>(order: Promise<T>): Promise<T | undefined> {
  try {
    return await order;
  } catch (error) {
    complain(error instanceof ApiError ? error.message
             : error instanceof TypeError ? 'The daemon does not answer: nothing was changed. Look whether emberlockd runs.'
             : String(error));
    return undefined;
  }
}

const kArmed = 5000;  // ms for the second press

/** A button for what must not happen by a slip: the first press arms it and says so, the second within 5 s does it. */
export class TwoStep {
  private timer?: number;

  constructor(readonly button: HTMLButtonElement, private readonly words: (armed: boolean) => string, private readonly done: () => void) {}

  get armed(): boolean {
    return this.timer !== undefined;
  }

  press(): void {
    if (!this.armed) {
      this.timer = window.setTimeout(() => this.disarm(), kArmed);
      this.show();
      return;
    }
    this.disarm();
    this.done();
  }

  disarm(): void {
    clearTimeout(this.timer);
    this.timer = undefined;
    this.show();
  }

  show(): void {
    set(this.button, 'data-armed', this.armed);
    setText(this.button, this.words(this.armed));
  }
}
