// SPDX-License-Identifier: Apache-2.0
// The page of `emberlock view`: a result's volumes, cameras and errors. Needs no server.
import {el, set, setText, show} from '../dom';
import {Plot} from '../plot';
import {Compare, errorOf} from './compare';
import {type Contents, type Frame, readFrame, type Triple, type Values} from './contents';
import {eyeOf, Orbit, placeOf} from './eye';
import {save, screenshot, turntable} from './film';
import {PlacedCameras} from './placed_cameras';
import {Quantities, single} from './quantities';
import {Slices} from './slices';
import {Stage} from './stage';

const kTurnSeconds = 8;
const kApart = 125;               // ms from frame to frame
const kMostFramesHeld = 8;

/** Frames that were read, the last ones. */
class Reader {
  private readonly held = new Map<number, Promise<Values>>();

  constructor(private readonly frames: readonly Frame[], private readonly block: (index: number) => string) {}

  get(index: number): Promise<Values> {
    const values = this.held.get(index) ?? readFrame(this.frames[index]!, this.block);
    this.held.delete(index);
    this.held.set(index, values);
    if (this.held.size > kMostFramesHeld) this.held.delete(this.held.keys().next().value!);
    return values;
  }
}

const kInput = {name: 'input views', colour: '#56b4e9'};
const kHeldOut = {name: 'held-out views', colour: '#e69f00'};

/** Which frames of a sequence are worse. */
function errorOfFrames({frames, cameras}: Contents): HTMLElement {
  const plot = new Plot('Error of each frame');
  const [input, heldOut] = (['input', 'held_out'] as const).map(role => frames.map(frame => errorOf(frame, cameras, role))) as [(number | null)[], (number | null)[]];
  const part = el('section', {class: 'part', 'aria-label': 'Error of each frame'}, el('h2', {}, 'Error of each frame'), plot.root);
  const lines = [{line: kInput, values: input}, {line: kHeldOut, values: heldOut}].filter(({values}) => values.some(value => value !== null));
  show(part, frames.length > 1 && lines.length > 0);
  if (!part.hidden) plot.show({x: 'frame', y: 'error, grey levels', lines: lines.map(({line}) => line)}, [frames.map(({frame}, n) => frame ?? n), ...lines.map(({values}) => values)]);
  return part;
}

function errorAgainstTime({trace}: Contents): HTMLElement {
  const plot = new Plot('Error against time');
  const part = el('section', {class: 'part', 'aria-label': 'Error against time'}, el('h2', {}, 'Error against time'), plot.root);
  const heldOut = trace.some(point => point.held_out !== null);
  show(part, trace.length > 0);
  if (trace.length > 0) {
    plot.show({x: 'seconds', y: 'error, grey levels', lines: [kInput, ...(heldOut ? [kHeldOut] : [])]},
              [trace.map(point => point.seconds), trace.map(point => point.input), ...(heldOut ? [trace.map(point => point.held_out)] : [])]);
  }
  return part;
}

export class ResultPage {
  private readonly canvas = el('canvas', {class: 'stage', tabindex: 0, role: 'img',
    'aria-label': 'The volume, to turn: drag it or use the arrow keys, + and - zoom'});
  private readonly stage: Stage;
  private readonly orbit: Orbit;
  private readonly reader: Reader;
  private readonly quantities = new Quantities(again => void (again ? this.load(true) : this.redraw()));
  private readonly slices: Slices;
  private readonly note = el('p', {class: 'note'});
  private readonly fault = el('p', {class: 'fault', role: 'alert', hidden: true});
  private readonly slider = el('input', {type: 'range', min: 0, step: 1, value: 0, 'aria-label': 'Frame of the sequence', oninput: () => this.goTo(this.slider.valueAsNumber)});
  private readonly frameLabel = el('span', {class: 'label'});
  private readonly play = el('button', {type: 'button', onclick: () => void this.toggle()}, 'Play');
  private readonly film = el('button', {type: 'button', onclick: () => void this.record()}, 'Turntable video');
  private readonly withCameras = el('input', {type: 'checkbox', checked: true, onchange: () => this.stage.later()});
  private compare?: Compare;
  private placed?: PlacedCameras;
  private at = 0;
  private playing = false;
  private recording = false;
  private order = 0;
  private sliced?: {frame: Frame; values: Float32Array; unit: string};
  readonly root: HTMLElement;

  constructor(private readonly contents: Contents, block: (index: number) => string) {
    const [first] = contents.frames as [Frame, ...Frame[]];
    const size = first.points.map(n => (n - 1) * first.edge) as unknown as Triple;
    const middle = [0, 1, 2].map(axis => first.origin[axis]! + size[axis]! / 2) as unknown as Triple;
    const reach = Math.hypot(...size) / 2;
    this.slices = new Slices(contents.up);
    this.reader = new Reader(contents.frames, block);
    this.orbit = new Orbit(middle, contents.up, reach);
    this.stage = new Stage(this.canvas, this.orbit);
    this.root = el('main', {class: 'viewer'});
    this.build(reach);
  }

  private build(reach: number): void {
    const {cameras, frames, title} = this.contents;
    if (cameras.length > 0) this.orbit.from(placeOf(cameras[0]!));
    const placed = new PlacedCameras(this.stage.gl, cameras, 0.35 * reach, () => this.stage.later());
    this.stage.company.push({draw: (...told) => { if (this.withCameras.checked && !this.stage.fixed) placed.draw(...told); }});
    this.placed = placed;
    this.compare = new Compare(cameras, index => { placed.chosen = index; this.stage.later(); }, index => this.lookFrom(index));
    this.stage.tapped = (eye, x, y) => {
      const camera = this.withCameras.checked ? placed.at(eye, x, y, 30) : -1;
      if (camera >= 0) this.compare!.choose(camera);
    };
    this.stage.drawn = ms => set(this.canvas, 'data-ms', ms.toFixed(1));
    this.slider.max = String(frames.length - 1);
    const player = el('div', {class: 'player', role: 'group', 'aria-label': 'Sequence', hidden: frames.length < 2}, this.play, this.slider, this.frameLabel);
    const around = el('button', {type: 'button', onclick: () => { this.stage.fixed = undefined; this.orbit.distance = 3.2 * reach; this.stage.later(); }}, 'See it all');
    const shot = el('button', {type: 'button', onclick: () => { this.stage.draw(); void screenshot(this.canvas, 'emberlock.png').catch(error => this.fail(error)); }}, 'Screenshot');
    const cameraBox = el('label', {hidden: cameras.length === 0}, this.withCameras, 'Cameras and their pictures');
    this.root.append(
      el('header', {}, el('h1', {}, title), this.note), this.fault,
      el('div', {class: 'beside'},
        el('section', {class: 'part', 'aria-label': 'The volume'}, this.canvas, player),
        el('section', {class: 'part knobs', 'aria-label': 'How it is shown'}, this.quantities.root, cameraBox, el('p', {class: 'line'}, around, shot, this.film))),
      el('section', {class: 'part', 'aria-label': 'Slices'}, el('h2', {}, 'Slices'), this.slices.root),
      this.compare.root, errorOfFrames(this.contents), errorAgainstTime(this.contents));
  }

  private fail(error: unknown): void {
    show(this.fault, true);
    setText(this.fault, error instanceof Error ? error.message : String(error));
  }

  /** The first picture is there when this is done. */
  async start(): Promise<void> {
    void this.reader.get(0).catch(() => undefined);  // meanwhile; load() tells what is wrong
    await this.stage.chosen;
    this.stage.renewed = () => void this.load(false);
    await this.load(true);
  }

  /** The frame at hand with the chosen quantity; `fresh` sets the controls by its values. */
  private async load(fresh: boolean): Promise<void> {
    const order = ++this.order;
    const frame = this.contents.frames[this.at]!;
    try {
      this.quantities.offer(frame);
      const values = await this.reader.get(this.at);
      if (order !== this.order) return;  // a later wish was quicker
      const name = this.quantities.chosen;
      if (fresh) this.quantities.span(frame, values);
      const channel = frame.channels.find(one => one.name === name)!;
      if (name === 'emission') this.stage.march.setLight(frame, values.get(name)!, values.get('density'));
      else this.stage.march.setQuantity(frame, single(values.get(name)!, channel.lanes));
      this.quantities.tell();
      const [nx, ny, nz] = frame.points;
      setText(this.note, `${nx - 1} × ${ny - 1} × ${nz - 1} voxels of ${(1000 * frame.edge).toFixed(2)} mm${this.contents.input ? `, from ${this.contents.input}` : ''}`);
      setText(this.frameLabel, frame.frame === null ? '' : `frame ${frame.frame}`);
      this.sliced = {frame, values: single(values.get(name)!, channel.lanes), unit: channel.unit};
      this.compare?.show(frame.views);
      if (!this.playing) this.placed?.show(frame.views);
      this.redraw();
      this.stage.draw();
      set(this.canvas, 'data-shown', `${this.at} ${name}`);
    } catch (error) {
      this.fail(error);
    }
  }

  private redraw(): void {
    this.stage.look = this.quantities.look;
    this.stage.later();
    if (!this.sliced) return;
    const {frame, values, unit} = this.sliced;
    const [low, high] = this.quantities.range;
    this.quantities.transfer.show(values, low, high);
    this.stage.march.setPalette(this.quantities.transfer.palette);
    const levels = this.quantities.chosen === 'emission' ? [] : this.quantities.levels;
    this.slices.show({grid: frame, values, unit, low, high, levels});
  }

  private lookFrom(index: number): void {
    const camera = this.contents.cameras[index];
    if (!camera) return;
    this.stage.fixed = (width, height) => eyeOf(camera, width, height);
    this.stage.later();
    this.canvas.scrollIntoView({block: 'nearest'});
  }

  private goTo(index: number): Promise<void> {
    this.at = index;
    this.slider.value = String(index);
    return this.load(false);
  }

  private async toggle(): Promise<void> {
    this.playing = !this.playing;
    setText(this.play, this.playing ? 'Pause' : 'Play');
    while (this.playing) {
      const due = performance.now() + kApart;
      await this.goTo((this.at + 1) % this.contents.frames.length);
      await new Promise(resolve => setTimeout(resolve, Math.max(0, due - performance.now())));
    }
    this.placed?.show(this.contents.frames[this.at]!.views);  // too many to be decoded in between
  }

  private async record(): Promise<void> {
    this.recording = !this.recording;
    if (!this.recording) return;
    setText(this.film, 'Stop');
    const {fixed} = this.stage;
    const from = this.orbit.turn;
    this.stage.fixed = undefined;
    try {
      const video = await turntable(this.canvas, kTurnSeconds, share => {
        this.orbit.turn = from + 360 * share;
        this.stage.draw();
      }, () => this.recording);
      save(video, `emberlock.${video.type.split('/')[1]!}`);
    } catch (error) {
      this.fail(error);
    }
    this.recording = false;
    this.orbit.turn = from;
    this.stage.fixed = fixed;
    setText(this.film, 'Turntable video');
    this.stage.later();
  }

  /** For tests and measurements: draws the view at a turn, and returns how long that took, ms. */
  drawAt(turn: number): number {
    this.orbit.turn = turn;
    return this.stage.draw();
  }
}
