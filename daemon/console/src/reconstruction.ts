// SPDX-License-Identifier: Apache-2.0
// A reconstruction as it runs: captured beside rendered after every iteration, error against time, the volume.
import type {DaemonStatus, Iteration, IterationPreview, Light, LiveStatus, ReconstructionStatus} from './api.gen';
import {act, TwoStep} from './act';
import {el, set, setText, show} from './dom';
import {fixed, known, percent, span} from './format';
import {Layers} from './layers';
import {showSign, Sign} from './light';
import {films, LiveLine} from './live_volumes';
import {bitmapOf, isGrey, paint} from './picture';
import {Player} from './player';
import {Plot} from './plot';
import {frameAtHand, Sequence} from './sequence';
import type {View, Volume} from './wire';
import {call} from './wire';
import type {VolumeView} from './volume';

const states: Record<ReconstructionStatus['state'], [Light, string]> = {
  STATE_UNSPECIFIED: ['LIGHT_UNSPECIFIED', ''],
  RUNNING: ['GREEN', 'running'],
  DONE: ['GREEN', 'done'],
  FAILED: ['RED', 'failed'],
  CANCELLED: ['AMBER', 'cancelled'],
};

export class Reconstruction {
  private readonly sign = new Sign();
  private readonly word = el('span', {class: 'word'});
  private readonly cancel = el('button', {class: 'quiet', type: 'button', onclick: () => this.cancelling.press()}, 'Cancel');
  private readonly cancelling = new TwoStep(this.cancel, armed => (armed ? 'Press again to cancel' : 'Cancel'), () => void act(call('Reconstruct/Cancel')));
  private readonly bar = el('progress', {max: 1, value: 0, 'aria-label': 'Progress'});
  private readonly doing = el('p', {role: 'status'});
  private readonly error = el('p', {class: 'verdict', 'data-verdict': 'FAILED', hidden: true});
  private readonly views = {captured: el('canvas', {width: 4, height: 3}), rendered: el('canvas', {width: 4, height: 3})};
  private readonly captions = {captured: el('figcaption', {}, 'Captured'), rendered: el('figcaption', {}, 'Rendered')};
  private readonly plot = new Plot('Error against time');
  private readonly latest = el('p', {class: 'latest'});
  private readonly place = el('div', {class: 'volume', tabindex: 0, role: 'img', 'aria-label': 'The reconstructed volume: drag to turn it, arrow keys turn it too'});
  private readonly volumeNote = el('p', {class: 'note'}, 'The volume comes with the first iteration.');
  private readonly layers = new Layers(() => { if (this.drawn) void this.draw(...this.drawn); });
  private readonly sequence = new Sequence();
  private readonly player = new Player((volume, voxels) => void this.draw(volume, voxels), () => { if (this.live) void this.draw(...this.live); });
  private readonly liveLine = new LiveLine();
  private readonly temperature = el('ul', {class: 'reasons'});
  private readonly effects = el('ul', {class: 'reasons'});
  private readonly advice = el('ul', {class: 'reasons'});
  private readonly result = el('p', {class: 'result'});
  private readonly content: HTMLElement;
  private readonly none = el('p', {class: 'empty'}, 'Nothing was reconstructed since the start. Sessions below has a button for each that is calibrated.');
  private readonly advised = el('div', {}, el('h3', {}, 'What the next step would cost'), this.advice);
  private readonly measured = el('div', {}, el('h3', {}, 'Temperature'), this.temperature);
  private readonly chosen = el('div', {}, el('h3', {}, 'Effects'), this.effects);
  private volume?: Promise<VolumeView>;
  private next?: [Volume, Uint8Array];
  private live?: [Volume, Uint8Array];
  private drawn?: [Volume, Uint8Array];
  private iterations: Iteration[] = [];
  private shown = '';  // id, and of a sequence the frame at hand
  private id = '';
  private viewsAsked = 0;
  private readonly newest = {captured: 0, rendered: 0};
  private grey = false;
  private ofRecording = false;  // what is shown is of a recording that goes on, or the newest was
  readonly root: HTMLElement;

  constructor() {
    this.content = el('div', {class: 'reconstruction', hidden: true},
      el('div', {class: 'pair'}, el('figure', {}, this.views.captured, this.captions.captured), el('figure', {}, this.views.rendered, this.captions.rendered)),
      el('div', {class: 'progress'}, this.sequence.root, this.latest, this.plot.root, this.measured, this.chosen, this.advised, this.result),
      el('div', {class: 'turn'}, this.liveLine.root, this.place, this.player.root, this.volumeNote, this.layers.root));
    this.place.addEventListener('keydown', event => {
      const by = {ArrowLeft: [-10, 0], ArrowRight: [10, 0], ArrowUp: [0, 10], ArrowDown: [0, -10]}[event.key];
      if (by === undefined || !this.volume) return;
      event.preventDefault();
      void this.volume.then(view => view.turn(by[0]!, by[1]!));
    });
    this.root = el('section', {id: 'reconstruction', class: 'panel', 'aria-labelledby': 'reconstruction-title'},
      el('header', {}, this.sign.root, el('h2', {id: 'reconstruction-title'}, 'Reconstruction'), this.word, this.doing, this.bar, this.cancel),
      this.error, this.none, this.content);
  }

  show(status: DaemonStatus): void {
    const {live, reconstruction: r} = status;
    if (films(status)) this.ofRecording = true;
    else if (r?.state === 'RUNNING') this.ofRecording = false;
    const shown = (this.ofRecording ? live : r) !== undefined;
    show(this.none, !shown);
    show(this.content, shown);
    set(this.content, 'data-live', this.ofRecording);
    show(this.liveLine.root, this.ofRecording);
    for (const part of [this.bar, this.cancel, this.sign.root]) show(part, shown);
    if (this.ofRecording && live) return this.showLive(status, live);
    if (!r) return;
    this.begin(r.id, frameAtHand(r));
    const part = r.state === 'FAILED' && r.frames.some(({state}) => state === 'DONE');
    const [light, word] = part ? ['AMBER', 'done in part'] as const : states[r.state];
    showSign(this.sign, this.word, light, word);
    this.bar.value = r.fraction;
    show(this.bar, r.state === 'RUNNING');
    show(this.cancel, r.state === 'RUNNING');
    setText(this.doing, [r.session, r.doing, r.state === 'RUNNING' ? percent(r.fraction) : '', span(r.seconds), r.device && `on ${r.device}`].filter(Boolean).join(' · '));
    show(this.error, r.error !== '');
    setText(this.error, r.error);
    if (r.iterations.length >= this.iterations.length) this.showIterations(r.iterations);
    for (const [list, lines, holder] of [[this.temperature, r.temperature, this.measured], [this.effects, r.effects, this.chosen], [this.advice, r.advice, this.advised]] as const) {
      show(holder, lines.length > 0);
      if (list.childElementCount !== lines.length || [...list.children].some((item, place) => item.textContent !== lines[place])) {
        list.replaceChildren(...lines.map(line => el('li', {}, line)));
      }
    }
    this.sequence.show(r.frames);
    this.player.show(r);
    setText(this.result, r.result ? `Written to ${r.result}` : '');
  }

  private showLive(status: DaemonStatus, live: LiveStatus): void {
    this.liveLine.show(status, live, this.sign, this.word);
    for (const part of [this.bar, this.cancel, this.error]) show(part, false);
    setText(this.doing, live.session);
  }

  preview(preview: IterationPreview): void {
    this.ofRecording = known(preview.live_delay_s);
    if (this.ofRecording) return this.begin(preview.reconstruction, undefined);
    this.begin(preview.reconstruction, preview.frame);
    const {iteration} = preview;
    if (iteration && iteration.iteration > (this.iterations.at(-1)?.iteration ?? -1)) this.showIterations([...this.iterations, iteration]);
  }

  async view(header: View, jpeg: Uint8Array): Promise<void> {
    const order = ++this.viewsAsked;
    const bitmap = await bitmapOf(jpeg);
    if (order < this.newest[header.kind]) return bitmap.close();  // a later one was quicker
    this.newest[header.kind] = order;
    paint(this.views[header.kind], bitmap);
    if (header.kind !== 'captured') return this.caption(header);
    const grey = isGrey(this.views.captured);
    const changed = grey !== this.grey;
    this.grey = grey;
    if (changed && this.drawn) void this.draw(...this.drawn);
    this.caption(header);
  }

  private caption(header: View): void {
    setText(this.captions[header.kind], `${header.kind === 'captured' ? 'Captured by' : 'Rendered as'} ${header.camera_id}, iteration ${header.iteration}`);
    set(this.views[header.kind], 'data-iteration', header.iteration);
  }

  showVolume(header: Volume, voxels: Uint8Array): void {
    this.live = [header, voxels];
    if (this.ofRecording || this.player.follows) void this.draw(header, voxels);
  }

  private async draw(header: Volume, voxels: Uint8Array): Promise<void> {
    this.next = [header, voxels];
    try {
      this.volume ??= import('./volume').then(module => new module.VolumeView(this.place));
      const view = await this.volume;
      if (!this.next) return;
      const newest = this.next;
      this.next = undefined;
      this.drawn = newest;
      const [{nx, ny, nz}] = newest;
      const measured = this.layers.show(...newest);
      view.show(...newest, this.grey, measured);
      set(this.place, 'data-voxels', nx * ny * nz);
      // Grey cameras' flame is grey; of others the volume has the brightness alone.
      const colours = measured ? 'as opaque as the flame is bright' : this.grey ? 'grey as its cameras see it' : 'brightness in false colours';
      setText(this.volumeNote, `${nx} × ${ny} × ${nz} voxels shown, ${colours}. Drag to turn, wheel to zoom.`);
    } catch (error) {
      setText(this.volumeNote, `The volume can't be shown: ${String(error)}. It needs WebGL 2.`);
    }
  }

  private begin(id: string, frame: number | undefined): void {
    const now = `${id} ${frame ?? ''}`;
    if (now === this.shown) return;
    this.shown = now;
    this.showIterations([]);
    if (id === this.id) return;
    this.id = id;
    this.layers.begin();
  }

  private showIterations(list: Iteration[]): void {
    if (list.length === this.iterations.length && list.length > 0) return;
    this.iterations = list;
    const last = list.at(-1);
    show(this.plot.root, last !== undefined);
    setText(this.latest, last ? `Iteration ${last.iteration}: error ${fixed(last.input_rmse, 2)} of 255${known(last.heldout_rmse) ? `, held out about ${fixed(last.heldout_rmse, 2)}` : ''}` : '');
    set(this.latest, 'data-iterations', list.length);
    if (!last) return;
    const heldOut = list.some(item => known(item.heldout_rmse));
    this.plot.show({x: 'seconds', y: 'error, grey levels', lines: [{name: 'input views', colour: '#56b4e9'}, ...(heldOut ? [{name: 'held out view', colour: '#e69f00'}] : [])]},
                   [list.map(item => item.seconds), list.map(item => item.input_rmse), ...(heldOut ? [list.map(item => item.heldout_rmse ?? null)] : [])]);
  }
}
