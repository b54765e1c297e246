// SPDX-License-Identifier: Apache-2.0
// A flame on a marker in a camera's live pictures: which result, on what marker, and how well the marker is seen.
import './live_flame.css';

import type {ArRequest, ArStatus, DaemonStatus, Light, ListResultsResponse} from './api.gen';
import {act} from './act';
import {el, set, setText, show} from './dom';
import {count, fixed, plural, sentence} from './format';
import {showSign, Sign} from './light';
import {call} from './wire';

/** How well the marker is seen, as a light, a word and numbers. */
export function arWords(ar: ArStatus): [Light, string, string] {
  const speed = ar.rate_hz > 0 ? `${fixed(ar.rate_hz, 0)} pictures/s, ${fixed(1000 * ar.delay_s, 0)} ms later` : '';
  const numbers = (...parts: string[]) => parts.filter(part => part !== '').join(' · ');
  if (ar.state === 'LOADING') return ['LIGHT_UNSPECIFIED', 'The flame is being read', ''];
  if (ar.state === 'FAILED') return ['RED', 'The flame ended', sentence(ar.error)];
  if (ar.state !== 'SHOWN') return ['LIGHT_UNSPECIFIED', 'No flame is shown', ''];
  switch (ar.pose) {
    case 'FOUND': return ['GREEN', 'Marker found', numbers(`to ${fixed(ar.residual_px, 2)} px`, speed)];
    case 'HELD': return ['AMBER', 'Marker covered: the flame is held', numbers(`for ${plural(ar.without, 'frame')}`, speed)];
    case 'LOST': return ['RED', 'Marker lost: no flame is shown', numbers(ar.seen_instead === '' ? `for ${plural(ar.without, 'frame')}` : `instead there is ${ar.seen_instead}`, speed)];
    case 'POSE_UNSPECIFIED': return ['LIGHT_UNSPECIFIED', 'Waits for a picture', ''];
  }
}

/** The camera whose live pictures have a flame. */
export function cameraWithFlame(status: DaemonStatus): string | undefined {
  return status.ar?.state === 'SHOWN' ? status.ar.camera_id : undefined;
}

function input(value: string, least: number, most: number, more: Record<string, string | number | boolean> = {}): HTMLInputElement {
  return el('input', {type: 'number', value, min: least, max: most, step: 'any', required: true, inputmode: 'decimal', ...more});
}

function labelled(words: string, control: HTMLElement, unit = ''): HTMLElement {
  set(control, 'aria-label', unit === '' ? words : `${words}, ${unit === '×' ? 'times' : unit}`);
  return el('label', {}, el('span', {}, words), control, el('span', {class: 'unit', 'aria-hidden': 'true'}, unit));
}

export class LiveFlame {
  private readonly result = el('select', {required: true});
  private readonly none = el('p', {class: 'note', hidden: true}, 'Nothing has been reconstructed yet: do that among the sessions first.');
  private readonly kind = el('select', {onchange: () => this.showKind()}, el('option', {value: 'aruco'}, 'ArUco marker'), el('option', {value: 'charuco'}, 'ChArUco board'));
  private readonly dictionary = el('select', {required: true});
  private readonly number = input('0', 0, 9999, {step: 1, inputmode: 'numeric'});
  private readonly edge = input('80', 1, 5000);
  private readonly columns = input('5', 2, 50, {step: 1, inputmode: 'numeric'});
  private readonly rows = input('4', 2, 50, {step: 1, inputmode: 'numeric'});
  private readonly square = input('30', 1, 5000);
  private readonly inner = input('22', 1, 5000);
  private readonly ofMarker = el('div', {class: 'fields'}, labelled('Number', this.number), labelled('Edge of its black border', this.edge, 'mm'));
  private readonly ofBoard = el('div', {class: 'fields', hidden: true}, labelled('Squares across', this.columns), labelled('Squares down', this.rows),
    labelled('Edge of a square', this.square, 'mm'), labelled('Edge of a marker in it', this.inner, 'mm'));
  private readonly scale = input('1', 0.001, 1000);
  private readonly brightness = input('1', 0.001, 1e6);
  private readonly focal = input('', 1, 1e6, {required: false, placeholder: 'as calibrated'});
  private readonly linear = el('input', {type: 'checkbox'});
  private readonly go = el('button', {type: 'submit'}, 'Show the flame');
  private readonly stop = el('button', {type: 'button', hidden: true, onclick: () => void this.order(call('Ar/Stop'))}, 'Stop the flame');
  private readonly form: HTMLFormElement;
  private readonly sign = new Sign();
  private readonly word = el('strong');
  private readonly numbers = el('span', {class: 'marker-numbers'});
  private readonly told = el('p', {class: 'told', hidden: true}, this.sign.root, el('span', {role: 'status'}, this.word), this.numbers);
  private readonly elsewhere = el('p', {class: 'note', hidden: true});
  private camera = '';
  private busy = false;
  private status?: DaemonStatus;
  readonly root: HTMLDetailsElement;

  constructor() {
    this.form = el('form', {class: 'fields', onsubmit: (event: Event) => {
      event.preventDefault();
      void this.order(call('Ar/Start', this.request()));
    }},
      labelled('Result', this.result), this.none, labelled('Marker', this.kind), labelled('Dictionary', this.dictionary), this.ofMarker, this.ofBoard,
      labelled('Flame’s size', this.scale, '×'), labelled('Flame’s light', this.brightness, '×'), labelled('Focal length', this.focal, 'px'),
      el('label', {class: 'check'}, this.linear, ' levels in proportion to light (else sRGB)'), this.go);
    this.root = el('details', {class: 'live-flame', ontoggle: () => { if (this.root.open) void this.refresh(); }},
      el('summary', {}, 'Flame on a marker'), this.told, this.stop, this.elsewhere, this.form);
    this.showKind();
  }

  /** `camera`: the one that is seen enlarged. */
  show(status: DaemonStatus, camera: string): void {
    this.status = status;
    this.camera = camera;
    const {ar} = status;
    const here = ar?.camera_id === camera ? ar : undefined;
    const running = ar?.state === 'SHOWN' || ar?.state === 'LOADING';
    show(this.told, here !== undefined && here.state !== 'STOPPED');
    if (here) {
      const [light, word, numbers] = arWords(here);
      showSign(this.sign, this.word, light, word);
      setText(this.numbers, numbers);
    }
    show(this.stop, here?.state === 'SHOWN');
    show(this.elsewhere, running && !here);
    setText(this.elsewhere, running && !here ? `The flame is shown by ${ar.camera_id}. Stop it there first.` : '');
    show(this.form, !running);
    this.enable();
    set(this.root, 'data-shown', here?.state === 'SHOWN');
  }

  private enable(): void {
    this.go.disabled = this.busy || this.result.options.length === 0;
    this.stop.disabled = this.busy;
    setText(this.go, this.busy ? 'The flame is being read …' : 'Show the flame');
  }

  private showKind(): void {
    const board = this.kind.value === 'charuco';
    show(this.ofMarker, !board);
    show(this.ofBoard, board);
    // What isn't seen isn't asked for.
    for (const field of this.ofMarker.querySelectorAll('input')) field.disabled = board;
    for (const field of this.ofBoard.querySelectorAll('input')) field.disabled = !board;
  }

  private async refresh(): Promise<void> {
    const listed = await act(call('Ar/Results'));
    if (!listed) return;
    this.list(listed);
    this.enable();
  }

  private list({results, dictionaries}: ListResultsResponse): void {
    const [result, dictionary] = [this.result.value, this.dictionary.value || '4X4_50'];
    const option = (session: string, which: string, words: string) => el('option', {value: JSON.stringify([session, which])}, words);
    this.result.replaceChildren(...results.map(({session, middle_frame, frames}) => el('optgroup', {label: session},
      middle_frame && option(session, 'middle-frame', `${session}: middle frame`),
      frames.length > 1 && option(session, '', `${session}: ${count(frames.length)} frames in turn`),
      ...frames.map(frame => option(session, `frame-${frame}`, `${session}: frame ${frame}`)))));
    this.dictionary.replaceChildren(...dictionaries.map(name => el('option', {value: name}, name)));
    this.dictionary.value = dictionary;
    if ([...this.result.options].some(each => each.value === result)) this.result.value = result;
    show(this.none, results.length === 0);
  }

  private request(): Partial<ArRequest> {
    const [session, result] = JSON.parse(this.result.value) as [string, string];
    const marker = this.kind.value === 'aruco' ? `aruco:${this.dictionary.value}:${this.number.value}:${this.edge.value}mm`
      : `charuco:${this.columns.value}x${this.rows.value}:${this.square.value}mm:${this.inner.value}mm:${this.dictionary.value}`;
    return {camera_id: this.camera, session, result, marker, scale: this.scale.valueAsNumber, brightness: this.brightness.valueAsNumber,
            ...(this.focal.value !== '' && {focal_px: this.focal.valueAsNumber}), linear: this.linear.checked};
  }

  private async order(order: Promise<ArStatus>): Promise<void> {
    this.busy = true;
    this.enable();
    const ar = await act(order);
    this.busy = false;
    if (ar && this.status) this.show({...this.status, ar}, this.camera);
    else this.enable();
  }
}
