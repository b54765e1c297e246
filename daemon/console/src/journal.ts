// SPDX-License-Identifier: Apache-2.0
// The daemon's journal, the newest line first.
import type {Notice} from './api.gen';
import {el, setText} from './dom';
import {timeOfDay} from './format';
import {lightWords, Sign} from './light';

const kLines = 300;

export class Journal {
  private readonly list = el('ol');
  private readonly note = el('p', {class: 'note'}, 'Nothing yet.');
  private newest = 0;
  readonly root = el('section', {id: 'journal', class: 'panel', 'aria-labelledby': 'journal-title'},
    el('header', {}, el('h2', {id: 'journal-title'}, 'Journal'), this.note),
    el('div', {class: 'journal', role: 'log', 'aria-live': 'off', 'aria-label': 'Lines of the journal', tabindex: 0}, this.list));

  add(notice: Notice): void {
    if (notice.id <= this.newest) return;
    this.newest = notice.id;
    this.list.prepend(el('li', {'data-light': notice.light}, new Sign(notice.light).root,
      el('span', {class: 'hidden'}, `${lightWords[notice.light]}: `), el('time', {datetime: notice.utc}, timeOfDay(notice.utc)), el('span', {}, notice.text)));
    while (this.list.children.length > kLines) this.list.lastElementChild!.remove();
    setText(this.note, '');
  }

  /** Another connection tells everything again; a daemon that was started anew counts from one. */
  clear(): void {
    this.newest = 0;
    this.list.replaceChildren();
  }
}
