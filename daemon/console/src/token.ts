// Asks for the token where the daemon wants one.
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
        el('h2', {id: 'token-title'}, 'Token'), el('p', {}, 'This daemon wants a token from other machines. Its file on the daemon\'s machine is named in the configuration.'),
        el('label', {for: 'token'}, 'Token'), this.input, el('button', {class: 'primary', type: 'submit'}, 'Unlock'), this.note));
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
