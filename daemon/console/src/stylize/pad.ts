// SPDX-License-Identifier: Apache-2.0
// The picture of a view that is edited: pointer and keys become places in its pixels for the tool at hand, which draws over it.
import {el, set} from '../dom';
import type {Point, Tool} from './tool';
import type {StylizationStatus_View as View} from '../api.gen';

const kStep = 5;       // px of the screen that an arrow key goes
const kLargeStep = 25; // with Shift

export class Pad {
  readonly picture = el('canvas', {width: 4, height: 3, 'aria-hidden': 'true'});
  private readonly marks = el('canvas', {width: 4, height: 3, class: 'pad-marks', 'aria-hidden': 'true'});
  readonly root = el('div', {class: 'pad', role: 'application', tabindex: 0, 'aria-label': 'The picture that is edited: arrow keys move the cross, Enter uses the tool there'},
                     this.picture, this.marks);
  private view?: View;
  private tool?: Tool;
  private pointer?: Point;
  private pressed = false;

  constructor() {
    const {root} = this;
    root.addEventListener('pointerdown', event => {
      if (event.button !== 0 || !this.view || !this.tool?.down) return;
      event.preventDefault();
      root.focus({preventScroll: true});
      root.setPointerCapture(event.pointerId);
      this.pressed = true;
      this.tool.down(this.moveTo(event));
      this.draw();
    });
    root.addEventListener('pointermove', event => {
      if (!this.view) return;
      const at = this.moveTo(event);
      if (this.pressed) this.tool?.drag?.(at);
      this.draw();
    });
    const lift = (event: PointerEvent): void => {
      if (!this.pressed) return;
      this.pressed = false;
      this.tool?.up?.(this.moveTo(event));
      this.draw();
    };
    root.addEventListener('pointerup', lift);
    root.addEventListener('pointercancel', lift);
    root.addEventListener('pointerleave', () => this.leave());
    root.addEventListener('blur', () => this.leave());
    root.addEventListener('wheel', event => {
      if (!this.tool?.wheel || document.activeElement !== root) return;  // the page is scrolled by whoever doesn't edit
      event.preventDefault();
      this.tool.wheel(-Math.sign(event.deltaY));
      this.draw();
    }, {passive: false});
    root.addEventListener('keydown', event => this.key(event));
  }

  /** What is drawn over the picture: of this view, by this tool. */
  show(view: View | undefined, tool: Tool): void {
    if (this.tool !== tool || this.view?.name !== view?.name) this.pressed = false;
    this.view = view;
    this.tool = tool;
    set(this.root, 'data-tool', tool.down ? 'yes' : undefined);
    this.draw();
  }

  draw(): void {
    const {view, marks, picture} = this;
    if (!view) return;
    // As fine as the screen, whatever size the picture comes in.
    const width = Math.max(1, Math.round(this.root.clientWidth * devicePixelRatio));
    const height = Math.max(1, Math.round(width * picture.height / picture.width));
    if (marks.width !== width || marks.height !== height) {
      marks.width = width;
      marks.height = height;
    }
    const context = marks.getContext('2d')!;
    const scale = width / view.width;
    context.setTransform(scale, 0, 0, height / view.height, 0, 0);
    context.clearRect(0, 0, view.width, view.height);
    this.tool?.draw?.(context, devicePixelRatio / scale, this.pointer);
    if (this.pointer && document.activeElement === this.root && this.tool?.down) this.drawCross(context, this.pointer, devicePixelRatio / scale);
  }

  private drawCross(context: CanvasRenderingContext2D, {x, y}: Point, unit: number): void {
    context.strokeStyle = '#fff';
    context.lineWidth = unit;
    context.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]] as const) {
      context.moveTo(x + 3 * unit * dx, y + 3 * unit * dy);
      context.lineTo(x + 9 * unit * dx, y + 9 * unit * dy);
    }
    context.stroke();
  }

  private moveTo(event: PointerEvent): Point {
    const {left, top, width, height} = this.marks.getBoundingClientRect();
    const {width: wide, height: high} = this.view!;
    return (this.pointer = {x: (event.clientX - left) / width * wide, y: (event.clientY - top) / height * high});
  }

  private leave(): void {
    if (this.pressed) return;
    this.pointer = undefined;
    this.draw();
  }

  private key(event: KeyboardEvent): void {
    const {view, tool} = this;
    if (!view || !tool?.down || event.ctrlKey || event.metaKey || event.altKey) return;
    const by = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
    if (!by && event.key !== 'Enter' && event.key !== ' ') return;
    event.preventDefault();
    const at = this.pointer ?? {x: view.width / 2, y: view.height / 2};
    if (by) {
      const step = (event.shiftKey ? kLargeStep : kStep) * view.width / this.root.clientWidth;
      this.pointer = {x: Math.min(view.width, Math.max(0, at.x + by[0]! * step)), y: Math.min(view.height, Math.max(0, at.y + by[1]! * step))};
    } else {
      this.pointer = at;
      tool.down(at);
      tool.up?.(at);
    }
    this.draw();
  }
}
