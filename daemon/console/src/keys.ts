// SPDX-License-Identifier: Apache-2.0
// Keyboard shortcuts, and the list of them.
import {el} from './dom';

export interface Shortcut {
  key: string;
  words: string;
  run(): void;
}

export class Keys {
  readonly help: HTMLDialogElement;

  constructor(shortcuts: Shortcut[]) {
    const fixedOnes = [['Arrows', 'from camera to camera'], ['Enter', 'enlarge the camera; arrows turn to others'], ['Esc', 'back'], ['?', 'this list']];
    this.help = el('dialog', {class: 'help', 'aria-labelledby': 'help-title'},
      el('header', {}, el('h2', {id: 'help-title'}, 'Keys'), el('button', {class: 'close', 'aria-label': 'Close', onclick: () => this.help.close()}, '✕')),
      el('dl', {}, ...[...shortcuts.map(({key, words}) => [key.toUpperCase(), words]), ...fixedOnes]
        .map(([key, words]) => el('div', {}, el('dt', {}, el('kbd', {}, key!)), el('dd', {}, words!)))),
      el('h3', {}, 'Signs'),
      el('p', {}, 'Disc: good. Triangle: goes on, somebody should look. Octagon: does not do what it should.'),
      el('p', {}, 'In the pictures: circle, the lamp; diamond, a dot; dashed line, where the dot should be; band, the tolerance.'));
    addEventListener('keydown', event => {
      if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
      const target = event.target as HTMLElement;
      if (target.matches('input:not([type=radio], [type=checkbox]), select, textarea')) return;
      if (event.key === '?') {
        if (this.help.open) this.help.close();
        else if (!document.querySelector('dialog[open]')) this.help.showModal();
        return;
      }
      if (document.querySelector('dialog[open]')) return;
      const shortcut = shortcuts.find(({key}) => key === event.key.toLowerCase());
      if (!shortcut) return;
      event.preventDefault();
      shortcut.run();
    });
  }
}
