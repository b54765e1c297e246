// SPDX-License-Identifier: Apache-2.0
// What an operator orders: carried out, and told when it fails; and orders that need a second press.
import {complain} from './complaints';
import {set, setText} from './dom';

/** The order's answer, or undefined where it failed, which is told. */
export async function act<T>(order: Promise<T>): Promise<T | undefined> {
  try {
    return await order;
  } catch (error) {
    complain(error);
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
