// SPDX-License-Identifier: Apache-2.0
// What went wrong with orders, told until its cause is gone: the order is carried out after all, the rig's state that forbade it is
// another, the daemon answers again. Each can be dismissed too.
import type {DaemonStatus} from './api.gen';
import {el} from './dom';
import {sentence} from './format';
import {Sign} from './light';
import {ApiError, answered} from './wire';

const kMost = 4;
const kOfState = ['FAILED_PRECONDITION', 'UNAVAILABLE', 'ABORTED'];  // gRPC's codes: another time the same order may be right
const kSilence = 'The daemon does not answer: nothing was changed. Look whether emberlockd runs.';

interface Complaint {
  toast: HTMLElement;
  order: string;    // its method, and the session that it is about
  state?: string;   // of the rig, where that was the reason
  silent: boolean;  // nobody answered
}

export const complaints = el('div', {class: 'toasts', role: 'region', 'aria-label': 'Complaints'});
const words = el('div', {class: 'toast-list', role: 'alert'});
complaints.append(words);
let list: Complaint[] = [];
let state = '';

/** What an order may be refused for. */
function stateOf({phase, recording, cameras, strobe, faults, jobs}: DaemonStatus): string {
  return JSON.stringify([phase, recording?.session, recording?.state, cameras.map(camera => camera.state), strobe?.light,
                         faults.filter(fault => !fault.over).map(fault => fault.id), jobs.map(job => [job.id, job.state])]);
}

function withdraw(gone: (complaint: Complaint) => boolean): void {
  for (const {toast} of list.filter(gone)) toast.remove();
  list = list.filter(complaint => !gone(complaint));
}

export function complain(error: unknown): void {
  const refused = error instanceof ApiError ? error : undefined;
  const silent = error instanceof TypeError;
  const message = sentence(refused?.message ?? (silent ? kSilence : String(error)));
  const order = refused?.order ?? message;
  withdraw(complaint => complaint.order === order);
  const toast = el('div', {class: 'toast'}, new Sign('RED').root, el('p', {}, message),
    el('button', {type: 'button', 'aria-label': `Dismiss: ${message}`, onclick: () => withdraw(complaint => complaint.toast === toast)}, '✕'));
  list.push({toast, order, silent, state: refused && kOfState.includes(refused.code) ? state : undefined});
  words.append(toast);
  if (list.length > kMost) withdraw(complaint => complaint === list[0]);
}

/** The rig as it is now: complaints of what it was before go. */
export function heard(status: DaemonStatus): void {
  const now = stateOf(status);
  if (now === state) return;
  state = now;
  withdraw(complaint => complaint.state !== undefined && complaint.state !== state);
}

/** The daemon answers, this order or any. */
answered.add(order => withdraw(complaint => complaint.silent || complaint.order === order));

export function connected(): void {
  withdraw(complaint => complaint.silent);
}
