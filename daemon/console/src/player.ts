// SPDX-License-Identifier: Apache-2.0
// Plays the volumes of a sequence's frames that are done. Until somebody plays or picks one, what is reconstructed at the moment
// is shown instead.
import type {ReconstructionStatus, SequenceFrame} from './api.gen';
import {complain} from './complaints';
import {el, set, setText, show} from './dom';
import {count, fixed, known} from './format';
import {ApiError, call, type Volume} from './wire';

type Held = [Volume, Uint8Array];

const kApart = 125;               // ms from frame to frame
const kMostBytes = 128 * 2 ** 20;

/** Volumes that were fetched, the ones last seen: as many as fit. */
class Cache {
  private readonly held = new Map<number, Held>();
  private bytes = 0;

  get(frame: number): Held | undefined {
    const found = this.held.get(frame);
    if (found) {
      this.held.delete(frame);
      this.held.set(frame, found);
    }
    return found;
  }

  set(frame: number, volume: Held): void {
    this.held.set(frame, volume);
    this.bytes += volume[1].length;
    for (const [oldest, [, voxels]] of this.held) {
      if (this.bytes <= kMostBytes) break;
      this.held.delete(oldest);
      this.bytes -= voxels.length;
    }
  }
}

export class Player {
  private readonly button = el('button', {class: 'play', type: 'button', onclick: () => this.toggle()}, 'Play');
  private readonly slider = el('input', {type: 'range', min: 0, max: 0, value: 0, step: 1, 'aria-label': 'Frame of the sequence', oninput: () => {
    const place = this.slider.valueAsNumber;
    this.pause();
    void this.pick(place);
  }});
  private readonly label = el('span', {class: 'label'});
  private readonly live = el('button', {class: 'quiet', type: 'button', onclick: () => this.follow()}, 'Live');
  private id = '';
  private frames: readonly SequenceFrame[] = [];
  private done: readonly SequenceFrame[] = [];
  private running = false;
  private cache = new Cache();
  private gone = new Set<number>();  // that the daemon no longer holds
  private picked?: number;           // its number; none while what is reconstructed is shown
  private turn = 0;                  // another one ends the play
  private playing = false;
  readonly root = el('div', {class: 'player', role: 'group', 'aria-label': 'Play the sequence', hidden: true}, this.button, this.slider, this.label, this.live);

  /** `shown` is given a frame's volume, `lived` told when what is reconstructed shall be shown again. */
  constructor(private readonly shown: (volume: Volume, voxels: Uint8Array) => void, private readonly lived: () => void) {}

  /** Whether what is reconstructed at the moment is shown. */
  get follows(): boolean {
    return this.picked === undefined;
  }

  show(status: ReconstructionStatus): void {
    if (status.id !== this.id) this.begin(status.id);
    this.frames = status.frames;
    this.done = status.frames.filter(({state}) => state === 'DONE');
    this.running = status.state === 'RUNNING';
    show(this.root, this.done.length > 0);
    if (this.done.length === 0) return;
    // What failed, or was cancelled, isn't what stays in sight.
    if (!this.running && this.follows) void this.pick(this.done.length - 1);
    this.update();
  }

  private begin(id: string): void {
    this.pause();
    this.id = id;
    this.picked = undefined;
    this.cache = new Cache();
    this.gone = new Set();
  }

  private toggle(): void {
    if (this.playing) return this.pause();
    this.playing = true;
    this.update();
    void this.play(++this.turn);
  }

  private pause(): void {
    ++this.turn;
    this.playing = false;
    this.update();
  }

  private follow(): void {
    this.pause();
    this.picked = undefined;
    this.lived();
    this.update();
  }

  private async play(turn: number): Promise<void> {
    while (turn === this.turn) {
      const apart = new Promise(resolve => setTimeout(resolve, kApart));
      await this.pick((this.place() + 1) % this.done.length);
      await apart;
    }
  }

  /** Of the picked frame among those that are done; -1: none is picked. */
  private place(): number {
    return this.done.findIndex(({frame}) => frame === this.picked);
  }

  private async pick(place: number): Promise<void> {
    const {frame} = this.done[place]!;
    this.picked = frame;
    this.update();
    const volume = await this.volumeOf(frame);
    if (volume && this.picked === frame) this.shown(...volume);
  }

  private async volumeOf(frame: number): Promise<Held | undefined> {
    const held = this.cache.get(frame);
    if (held || this.gone.has(frame)) return held;
    const {id, cache, gone} = this;
    const answer = await call('Reconstruct/Frame', {reconstruction: id, frame}).catch((error: unknown) => {
      if (error instanceof ApiError && error.code === 'NOT_FOUND') {
        gone.add(frame);
        return this.update();
      }
      this.pause();
      complain(error);
    });
    if (!answer?.volume) return undefined;
    const {voxels, layers, ...header} = answer.volume;
    const letters = [voxels, ...layers.map(layer => layer.voxels)].map(text => atob(text)).join('');
    const bytes = new Uint8Array(letters.length);
    for (let at = 0; at < bytes.length; ++at) bytes[at] = letters.charCodeAt(at);
    const volume: Held = [{kind: 'volume', ...header, layers: layers.map(({kind, low, high, quick}) => ({kind, low, high, quick}))}, bytes];
    cache.set(frame, volume);
    return volume;
  }

  private update(): void {
    setText(this.button, this.playing ? 'Pause' : 'Play');
    show(this.live, this.running && !this.follows);
    const place = this.place();
    set(this.slider, 'max', Math.max(0, this.done.length - 1));
    this.slider.value = String(place < 0 ? this.done.length - 1 : place);
    const words = this.words(this.done[place]);
    setText(this.label, words);
    set(this.slider, 'aria-valuetext', words);
  }

  private words(frame: SequenceFrame | undefined): string {
    if (!frame) return 'live';
    const where = `frame ${frame.frame}, ${count(this.frames.indexOf(frame) + 1)} of ${count(this.frames.length)}`;
    if (this.gone.has(frame.frame)) return `${where}: no longer held`;
    return known(frame.input_rmse) && frame.input_rmse > 0 ? `${where}: error ${fixed(frame.input_rmse, 2)}` : where;
  }
}
