// SPDX-License-Identifier: Apache-2.0
// Says what to do where the daemon doesn't know this browser any more, and takes the token where there is one.
import {el, setText} from './dom';

export class Token {
  private readonly input = el('input', {type: 'password', name: 'token', autocomplete: 'current-password', required: true, id: 'token'});
  private readonly note = el('p', {class: 'note', role: 'alert'});
  readonly root: HTMLDialogElement;

  constructor(unlock: (token: string) => Promise<boolean>) {
    this.root = el('dialog', {class: 'token', 'aria-labelledby': 'token-title'},
      el('form', {onsubmit: async (event: Event) => {
        event.preventDefault();
        if (await unlock(this.input.value)) this.close();
        else setText(this.note, 'That is not the token.');
      }},
        el('h2', {id: 'token-title'}, 'This browser isn\'t let in any more'),
        el('p', {}, 'The daemon has started anew, perhaps. On its machine ', el('code', {}, 'emberlock console'), ' prints a link: open it in this browser, then come back here.'),
        el('label', {for: 'token'}, 'Or give the daemon\'s token'), this.input, el('button', {class: 'primary', type: 'submit'}, 'Unlock'), this.note));
  }

  ask(): void {
    if (this.root.open) return;
    this.input.value = '';
    this.root.showModal();
    this.input.focus();
  }

  close(): void {
    setText(this.note, '');
    if (this.root.open) this.root.close();
  }
}
