// SPDX-License-Identifier: Apache-2.0
// The canvas in which the volume stands: what is drawn and when, and how it is turned by mouse, fingers and keys.
import {set} from '../dom';
import type {Triple} from './contents';
import type {Eye, Orbit} from './eye';
import type {Look, March} from './march';
import {GlMarch} from './march_gl';
import {gpuMarch} from './march_gpu';

/** What else is drawn, before the volume and over it. */
export interface Company {
  draw(eye: Eye, width: number, height: number, middle: Triple, behind: boolean): void;
}

const kKeys: Record<string, readonly [number, number, number]> = {
  ArrowLeft: [-5, 0, 1], ArrowRight: [5, 0, 1], ArrowUp: [0, 5, 1], ArrowDown: [0, -5, 1], '+': [0, 0, 1.2], '=': [0, 0, 1.2], '-': [0, 0, 1 / 1.2],
};
const kSlow = 70;     // ms a picture: while it is moved, slower ones get fewer pixels
const kLate = 1000;   // ms until WebGPU is no longer waited for
const kForced = 30_000;
const kRest = 200;    // ms without a movement: then all pixels

export class Stage {
  readonly gl: WebGL2RenderingContext;
  /** By WebGL 2, or by WebGPU where that answers. */
  march: March;
  /** Told when `march` is another one, which has no values yet. */
  renewed: () => void = () => undefined;
  /** When it is settled which one draws. */
  readonly chosen: Promise<void>;
  readonly company: Company[] = [];
  look: Look = {mode: 'colour', gain: 1};
  /** As a camera sees it; turning leaves it. */
  fixed?: (width: number, height: number) => Eye;
  tapped: (eye: Eye, x: number, y: number) => void = () => undefined;
  drawn: (ms: number) => void = () => undefined;
  private due = false;
  private moved = -Infinity;
  private coarse = 1;   // pixels of the canvas along an edge of a drawn one, while it is moved
  private readonly fingers = new Map<number, PointerEvent>();
  private travelled = 0;

  constructor(readonly canvas: HTMLCanvasElement, public orbit: Orbit) {
    const gl = canvas.getContext('webgl2', {antialias: false, alpha: false, preserveDrawingBuffer: true});
    if (!gl) throw new Error('this browser has no WebGL 2');
    this.gl = gl;
    this.march = new GlMarch(gl);
    this.chosen = this.choose();
    new ResizeObserver(() => this.later()).observe(canvas);
    this.listen();
  }

  /** `?renderer=webgl` in the page's address, or `webgpu`, also by software, has its way. What doesn't answer soon isn't waited for. */
  private async choose(): Promise<void> {
    const wish = new URLSearchParams(location.search).get('renderer');
    const plain = this.march;
    let lost = false;
    const failed = () => {
      lost = true;
      if (this.march !== plain) this.take(plain);
    };
    set(this.canvas, 'data-renderer', plain.name);
    if (wish === 'webgl') return;
    const late = new Promise<undefined>(resolve => setTimeout(resolve, wish === 'webgpu' ? kForced : kLate));
    const march = await Promise.race([gpuMarch(this.gl, wish === 'webgpu', failed), late]);
    if (march && !lost) this.take(march);
  }

  private take(march: March): void {
    this.march = march;
    set(this.canvas, 'data-renderer', march.name);
    this.renewed();
  }

  /** Soon, at once for all that changes until then. */
  later(): void {
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.draw();
    });
  }

  get eye(): Eye {
    return this.eyeFor(this.canvas.clientWidth, this.canvas.clientHeight);
  }

  private eyeFor(width: number, height: number): Eye {
    return this.fixed ? this.fixed(width, height) : this.orbit.eye(width, height);
  }

  /** At once; all pixels unless it is being moved on a slow machine. Returns milliseconds until it was drawn. */
  draw(): number {
    const {canvas, gl} = this;
    const moving = performance.now() - this.moved < kRest;
    const share = devicePixelRatio / (moving ? this.coarse : 1);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map(length => Math.max(1, Math.round(share * length))) as [number, number];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    const begin = performance.now();
    const eye = this.eyeFor(width, height);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    for (const one of this.company) one.draw(eye, width, height, this.orbit.about, true);
    this.march.draw(eye, this.look, width, height);
    for (const one of this.company) one.draw(eye, width, height, this.orbit.about, false);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));  // waits until it is there
    const took = performance.now() - begin;
    if (moving) this.coarse = Math.max(1, Math.min(4, this.coarse * Math.sqrt(took / kSlow)));
    this.drawn(took);
    return took;
  }

  /** By degrees around the upright axis and over it, and so many times as near. */
  move(turn: number, tilt: number, zoom: number): void {
    this.fixed = undefined;
    this.orbit.by(turn, tilt);
    this.orbit.zoom(zoom);
    this.moved = performance.now();
    this.later();
    setTimeout(() => { if (performance.now() - this.moved >= kRest) this.later(); }, kRest + 20);
  }

  private listen(): void {
    const {canvas, fingers} = this;
    canvas.addEventListener('pointerdown', event => {
      fingers.set(event.pointerId, event);
      this.travelled = 0;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointerup', event => {
      if (fingers.size === 1 && this.travelled < 4) this.tapped(this.eye, event.offsetX, event.offsetY);
    });
    for (const over of ['pointerup', 'pointercancel'] as const) canvas.addEventListener(over, event => void fingers.delete(event.pointerId));
    canvas.addEventListener('pointermove', event => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const [x, y] = [event.clientX - before.clientX, event.clientY - before.clientY];
      this.travelled += Math.hypot(x, y);
      const other = [...fingers.values()].find(finger => finger.pointerId !== event.pointerId);
      fingers.set(event.pointerId, event);
      const far = (finger: PointerEvent) => Math.hypot(finger.clientX - other!.clientX, finger.clientY - other!.clientY) || 1;
      if (other) this.move(0, 0, far(event) / far(before));
      else if (this.travelled >= 4) this.move(-0.5 * x, 0.5 * y, 1);
    });
    canvas.addEventListener('wheel', event => {
      if (!canvas.closest(':focus')) return;  // else the page scrolls
      event.preventDefault();
      this.move(0, 0, 2 ** (-event.deltaY / 400));
    }, {passive: false});
    canvas.addEventListener('keydown', event => {
      const by = kKeys[event.key];
      if (!by || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      this.move(...by);
    });
  }
}
