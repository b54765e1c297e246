// SPDX-License-Identifier: Apache-2.0
// One camera over the whole page, with every number known of it.
import type {CameraStatus, DaemonStatus} from './api.gen';
import {el, setText, show} from './dom';
import {Exposure} from './exposure';
import {count, fixed, known, micros, ppm, rows, short, span} from './format';
import {lampAdvice, lampMissing} from './lamp';
import {cameraWord, showSign, Sign} from './light';
import {cameraWithFlame, LiveFlame} from './live_flame';
import {Gauge, Overlay} from './overlay';
import {LivePicture} from './picture';

const resetWords = {SHUTTER_RESET_UNSPECIFIED: 'unknown', NONE: 'not possible', BY_HAND: 'by hand', ON_COMMAND: 'on command'};
const sensorWords = {CCD: 'CCD', ROLLING_SHUTTER: 'rolling shutter', GLOBAL_SHUTTER: 'global shutter'};

/** Every number of a camera with its name. */
export function facts(c: CameraStatus, tolerance: number | undefined): [string, string][] {
  const list: [string, string][] = [
    ['error', known(c.error_rows) ? `${rows(c.error_rows)} = ${micros(c.error_s)}` : '–'],
    ['known to', known(c.sigma_rows) ? `± ${fixed(c.sigma_rows, 1)} rows` : '–'],
    ['tolerance', known(tolerance) ? `± ${short(tolerance)}${known(c.row_time_s) ? ` (${fixed(tolerance / c.row_time_s, 1)} rows)` : ''}` : '–'],
    ['drift', ppm(c.drift_ppm)],
    ['time left', span(c.time_left_s)],
    ['trials (resets)', count(c.resets)],
    ['reset', resetWords[c.reset]],
    ['row time', known(c.row_time_s) ? `${fixed(c.row_time_s * 1e6, 3)} µs` : '–'],
    ['target row', known(c.target_row) ? fixed(c.target_row, 1) : '–'],
    ['sight', c.sight || '–'],
    ['rate', `${fixed(c.measured_rate_hz || c.frame_rate_hz, 3)} Hz${c.measured_rate_hz ? '' : ' nominal'}`],
    ['trim', ppm(c.trim_ppm)],
    ['picture', `${c.width} × ${c.height}`],
    ['sensor', sensorWords[c.sensor]],
    ['model', c.model || '–'],
    ['driver', c.driver],
    ...(c.host ? [['host', c.host] as [string, string]] : []),
  ];
  const n = c.counts;
  if (n) {
    list.push(['delivered', count(n.delivered)], ['damaged', count(n.damaged)], ['camera gaps', count(n.camera_gap)],
              ['lost in transport', count(n.transport + n.resend)], ['no buffer', count(n.underrun)], ['queue full', count(n.queue)],
              ['passed over', count(n.passed_over)]);
  }
  return list;
}

export class Enlarged {
  readonly picture = new LivePicture();
  id?: string;
  private readonly overlay = new Overlay();
  private readonly gauge = new Gauge();
  private readonly sign = new Sign();
  private readonly word = el('span', {class: 'word'});
  private readonly title = el('h2');
  private readonly reason = el('p', {class: 'reason'});
  private readonly exposure = new Exposure(this.picture.canvas);
  private readonly flame = new LiveFlame();
  private readonly flameMark = el('span', {class: 'flame-mark', hidden: true}, 'flame added');
  private readonly lamp = el('p', {class: 'lamp-advice'});
  private readonly list = el('dl', {class: 'facts'});
  private readonly error = el('p', {class: 'error-rows'});
  readonly root: HTMLDialogElement;
  private status?: DaemonStatus;

  constructor(private readonly changed: () => void) {
    this.root = el('dialog', {class: 'enlarged', 'aria-label': 'Camera'},
      el('div', {class: 'picture'}, this.picture.canvas, this.exposure.marks, this.overlay.root, this.flameMark),
      el('div', {class: 'side'},
        el('header', {}, this.sign.root, this.title, this.word,
          el('button', {class: 'close', 'aria-label': 'Close', onclick: () => this.root.close()}, '✕')),
        this.error, this.gauge.root, this.reason, this.lamp, this.flame.root, this.exposure.root, this.list,
        el('p', {class: 'legend'}, el('span', {class: 'key lamp'}, '○ lamp'), el('span', {class: 'key dot'}, '◇ dot'),
          el('span', {class: 'key target'}, '┄ target row'), el('span', {class: 'key band'}, '▒ tolerance')),
        el('p', {class: 'note'}, '← → other cameras, Esc back')));
    this.root.addEventListener('close', () => {
      this.exposure.stop();
      const tile = document.querySelector<HTMLElement>(`.tile[data-camera="${CSS.escape(this.id ?? '')}"]`);
      this.id = undefined;
      tile?.focus();
      this.changed();
    });
    this.root.addEventListener('keydown', event => {
      if ((event.target as HTMLElement).closest('input, select')) return;  // they have arrow keys of their own
      if (event.key === 'ArrowLeft') this.turn(-1);
      if (event.key === 'ArrowRight') this.turn(1);
    });
    this.root.addEventListener('click', event => { if (event.target === this.root) this.root.close(); });
  }

  open(id: string): void {
    this.id = id;
    this.picture.restart();
    const shown = document.querySelector<HTMLCanvasElement>(`.tile[data-camera="${CSS.escape(id)}"] canvas`);
    if (shown) {
      this.picture.canvas.width = shown.width;
      this.picture.canvas.height = shown.height;
      this.picture.canvas.getContext('2d', {alpha: false})!.drawImage(shown, 0, 0);
    }
    if (this.status) this.show(this.status);
    if (!this.root.open) this.root.showModal();
    this.exposure.start();
    this.changed();
  }

  show(status: DaemonStatus): void {
    this.status = status;
    if (this.id === undefined) return;
    const camera = status.cameras.find(each => each.id === this.id);
    if (!camera) {
      this.root.close();
      return;
    }
    const tolerance = status.alignment?.tolerance_s || undefined;
    setText(this.title, camera.id);
    showSign(this.sign, this.word, camera.light, cameraWord(camera, tolerance));
    setText(this.error, known(camera.error_rows) ? `${rows(camera.error_rows)} · ${micros(camera.error_s)}` : short(undefined));
    this.gauge.show(camera.error_s, tolerance);
    setText(this.reason, camera.reason);
    this.exposure.lampMissing = lampMissing(camera, status.faults);
    setText(this.lamp, this.exposure.lampMissing ? lampAdvice(camera) : '');
    this.overlay.show(camera);
    this.flame.show(status, camera.id);
    const added = cameraWithFlame(status) === camera.id;
    show(this.flameMark, added);
    this.exposure.pause(added);
    const all = facts(camera, tolerance);
    while (this.list.children.length > all.length) this.list.lastElementChild!.remove();
    while (this.list.children.length < all.length) this.list.append(el('div', {}, el('dt'), el('dd')));
    all.forEach(([name, value], place) => {
      setText(this.list.children[place]!.children[0]!, name);
      setText(this.list.children[place]!.children[1]!, value);
    });
  }

  private turn(by: number): void {
    const ids = this.status?.cameras.map(camera => camera.id) ?? [];
    const id = ids[(ids.indexOf(this.id ?? '') + by + ids.length) % ids.length];
    if (id !== undefined) this.open(id);
  }
}
