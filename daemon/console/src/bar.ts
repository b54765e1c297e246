// SPDX-License-Identifier: Apache-2.0
// On a phone: the state and the orders that can't wait stay at the screen's lower edge, wherever one has scrolled to.
import type {DaemonStatus} from './api.gen';
import {el, set, setText, show} from './dom';
import {clock} from './format';
import {tally} from './header';
import type {Connection} from './link';
import {phaseWords, showSign, Sign} from './light';

export class Bar {
  private readonly sign = new Sign();
  private readonly word = el('strong');
  private readonly clock = el('span', {class: 'clock', hidden: true});
  private readonly tally = el('span', {class: 'tally'});
  private readonly parts = el('div', {class: 'bar-orders'});
  private readonly phone = matchMedia('(max-width: 700px)');  // as in style.css
  private status?: DaemonStatus;
  private connected = false;
  readonly root = el('section', {class: 'bar', 'aria-label': 'State and orders', hidden: true},
                     el('div', {class: 'bar-state'}, this.sign.root, el('div', {}, this.word, ' ', this.clock, ' ', this.tally)), this.parts);

  /** `parts` stand in their panels, and here while the screen is a phone's. */
  constructor(parts: HTMLElement[]) {
    const places = parts.map(part => {
      const place = document.createComment('');
      part.before(place);
      return place;
    });
    const move = (): void => {
      show(this.root, this.phone.matches);
      if (this.phone.matches) this.parts.append(...parts);
      else parts.forEach((part, at) => { if (part.parentElement === this.parts) places[at]!.after(part); });
    };
    this.phone.addEventListener('change', move);
    move();
    // What scrolls ends above it.
    new ResizeObserver(() => document.documentElement.style.setProperty('--bar', `${this.root.offsetHeight}px`)).observe(this.root);
  }

  connection(state: Connection): void {
    this.connected = state === 'open';
    this.tell();
  }

  show(status: DaemonStatus): void {
    this.status = status;
    this.tell();
  }

  private tell(): void {
    const {status, connected} = this;
    showSign(this.sign, this.word, connected && status ? status.light : 'LIGHT_UNSPECIFIED', !connected ? 'No connection' : status ? phaseWords[status.phase] : '…');
    set(this.root, 'data-light', connected ? status?.light : undefined);
    show(this.clock, connected && status?.phase === 'CAPTURING');
    setText(this.clock, clock(status?.recording?.seconds ?? 0));
    setText(this.tally, connected && status ? tally(status) : '');
  }
}
