// SPDX-License-Identifier: Apache-2.0
// One camera: its live picture with what alignment saw, and the numbers that an operator acts on.
import type {CameraStatus} from './api.gen';
import {el, set, setText, show} from './dom';
import {count, known, micros, ppm, rows, span} from './format';
import {cameraWord, lostFrames, showSign, Sign} from './light';
import {Gauge, Overlay} from './overlay';
import {LivePicture} from './picture';

export class Tile {
  readonly picture = new LivePicture();
  camera?: CameraStatus;
  private readonly sign = new Sign();
  private readonly word = el('span', {class: 'word'});
  private readonly hosts = [el('span', {class: 'at', hidden: true}), el('span', {class: 'at', hidden: true})] as const;  // beside its error, or its name where that isn't shown
  private readonly overlay = new Overlay();
  private readonly gauge = new Gauge();
  private readonly error = el('span', {class: 'error-rows'});
  private readonly time = el('span', {class: 'error-time'});
  private readonly drift = el('dd');
  private readonly left = el('dd');
  private readonly trials = el('dd');
  private readonly lost = el('dd');
  private readonly reason = el('p', {class: 'reason'});
  private readonly nextMark = el('span', {class: 'next-mark', hidden: true});
  private readonly flameMark = el('span', {class: 'flame-mark', hidden: true}, 'flame added');
  private readonly frame = el('div', {class: 'picture'}, this.picture.canvas, this.overlay.root, this.nextMark, this.flameMark);
  readonly root: HTMLElement;

  constructor(readonly id: string, open: (id: string) => void) {
    // Its words and numbers are its name.
    this.root = el('div', {class: 'tile', tabindex: 0, role: 'button', 'data-camera': id, onclick: () => open(id)},
      this.frame,
      el('div', {class: 'facts'},
        el('header', {}, this.sign.root, el('h3', {}, el('span', {}, id), ' ', this.hosts[1]), this.word),
        this.reason,
        el('div', {class: 'error'}, this.error, el('span', {class: 'error-more'}, this.time, this.hosts[0])),
        this.gauge.root,
        el('dl', {},
          el('div', {}, el('dt', {}, 'drift'), this.drift),
          el('div', {}, el('dt', {}, 'left'), this.left),
          el('div', {}, el('dt', {}, 'trials'), this.trials),
          el('div', {}, el('dt', {}, 'lost'), this.lost))));
    this.root.addEventListener('keydown', event => {
      if (event.key !== 'Enter' && event.key !== ' ') return;
      event.preventDefault();
      open(id);
    });
  }

  /** `next`: somebody is to reset it now; `flame`: one is drawn into its pictures; `host`: that has it, empty for this one. */
  show(camera: CameraStatus, tolerance: number | undefined, next: boolean, flame: boolean, host: string): void {
    this.camera = camera;
    const word = cameraWord(camera, tolerance);
    showSign(this.sign, this.word, camera.light, word);
    for (const each of this.hosts) {
      show(each, host !== '');
      setText(each, host);
      set(each, 'title', camera.host || undefined);
    }
    set(this.root, 'data-light', camera.light);
    set(this.root, 'data-state', camera.state);
    set(this.root, 'data-next', next);
    show(this.nextMark, camera.reset_next);
    show(this.flameMark, flame);
    setText(this.nextMark, next ? 'Reset this camera now' : camera.reset === 'BY_HAND' ? 'Reset after that' : 'Being reset');
    this.overlay.show(camera);
    this.frame.style.setProperty('--aspect', camera.width > 0 && camera.height > 0 ? String(camera.width / camera.height) : '4 / 3');
    this.gauge.show(camera.error_s, tolerance);
    setText(this.error, known(camera.error_rows) ? rows(camera.error_rows) : '– rows');
    setText(this.time, known(camera.error_s) ? micros(camera.error_s) : '');
    setText(this.drift, ppm(camera.drift_ppm));
    setText(this.left, span(camera.time_left_s));
    setText(this.trials, count(camera.resets));
    const lost = lostFrames(camera);
    setText(this.lost, count(lost));
    set(this.lost.parentElement!, 'data-bad', lost > 0);
    setText(this.reason, camera.reason);
  }
}
