// SPDX-License-Identifier: Apache-2.0
// How opaque each value is: a curve of a few points over a histogram of the values, from the lowest in colour to the highest.
import {el, set, svg} from '../dom';
import {heat} from '../layers';

/** Of a curve: where from lowest to highest, and how opaque there, both 0..1. Curves rise in x, from 0 to 1. */
export type Knot = readonly [number, number];

const kStraight: readonly Knot[] = [[0, 0], [1, 1]];
const kDarkest = 0.15;   // of the palette: what is shown in space stands out from black
const kBins = 64;
const kSize = [256, 96] as const;
const kReach = 12;       // of a point, in the drawing's units: nearer presses take hold of it
const kStep = 0.05;      // by an arrow key

/** By straight lines between the knots. */
export function opacityAt(knots: readonly Knot[], x: number): number {
  const next = Math.max(1, knots.findIndex(([at]) => x <= at));
  const [[x0, y0], [x1, y1]] = [knots[next - 1]!, knots[next]!];
  return x1 > x0 ? y0 + (y1 - y0) * (x - x0) / (x1 - x0) : y1;
}

/** How many values are in each of so many equal parts from low to high. */
export function histogram(values: Float32Array, low: number, high: number, bins: number): number[] {
  const counts = new Array<number>(bins).fill(0);
  for (const value of values) if (value > 0 && value >= low && value <= high) ++counts[Math.min(bins - 1, Math.floor(bins * (value - low) / (high - low || 1)))]!;
  return counts;
}

/** A knot at a place, kept between its neighbours; the first and the last stay at the ends. */
export function moved(knots: readonly Knot[], which: number, [x, y]: Knot): Knot[] {
  const within = (value: number, least: number, most: number) => Math.max(least, Math.min(most, value));
  const at = which === 0 ? 0 : which === knots.length - 1 ? 1 : within(x, knots[which - 1]![0], knots[which + 1]![0]);
  return knots.map((knot, n) => n === which ? [at, within(y, 0, 1)] : knot);
}

const inserted = (knots: readonly Knot[], before: number, knot: Knot): Knot[] => [...knots.slice(0, before), knot, ...knots.slice(before)];

export class Transfer {
  private knots: readonly Knot[] = kStraight;
  private held = -1;
  private readonly counts = svg('path', {class: 'counts'});
  private readonly line = svg('polyline', {class: 'curve'});
  private readonly handles = svg('g');
  private readonly drawing: SVGSVGElement = svg('svg', {class: 'transfer', viewBox: `0 0 ${kSize[0]} ${kSize[1]}`, role: 'group', 'aria-label': 'Opacity of each value',
    onpointerdown: (event: PointerEvent) => this.press(event), onpointermove: (event: PointerEvent) => { if (this.held >= 0) this.change(moved(this.knots, this.held, this.place(event))); },
    onpointerup: () => { this.held = -1; }, onpointercancel: () => { this.held = -1; }}, this.counts, this.line, this.handles);
  readonly root = el('div', {}, this.drawing,
    el('button', {type: 'button', onclick: () => this.change(kStraight)}, 'Straight'));

  constructor(private readonly changed: () => void) {
    this.draw();
  }

  /** Red, green, blue and opacity, 0..255, from the lowest value to the highest. */
  get palette(): number[][] {
    return Array.from({length: 256}, (_, n) => [...heat(255 * kDarkest + (1 - kDarkest) * n), Math.round(255 * opacityAt(this.knots, n / 255))]);
  }

  show(values: Float32Array, low: number, high: number): void {
    const counts = histogram(values, low, high, kBins);
    const most = Math.sqrt(Math.max(1, ...counts));
    const [width, height] = kSize;
    set(this.counts, 'd', `M0 ${height}${counts.map((count, n) => `V${(height * (1 - Math.sqrt(count) / most)).toFixed(1)}H${width * (n + 1) / kBins}`).join('')}V${height}Z`);
  }

  private place(event: PointerEvent): Knot {
    const box = this.drawing.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, 1 - (event.clientY - box.top) / box.height];
  }

  /** Takes hold of the knot that is pressed, or of a new one. */
  private press(event: PointerEvent): void {
    const [x, y] = this.place(event);
    const away = this.knots.map(([at, opaque]) => Math.hypot(kSize[0] * (at - x), kSize[1] * (opaque - y)));
    this.held = away.indexOf(Math.min(...away));
    if (away[this.held]! > kReach) {
      this.held = Math.max(1, this.knots.findIndex(([at], n) => at > x || n === this.knots.length - 1));
      this.change(moved(inserted(this.knots, this.held, [x, y]), this.held, [x, y]));
    }
    this.drawing.setPointerCapture(event.pointerId);
    event.preventDefault();
    (this.handles.children[this.held] as SVGElement).focus();
  }

  private key(event: KeyboardEvent, which: number): void {
    const by = ({ArrowLeft: [-kStep, 0], ArrowRight: [kStep, 0], ArrowUp: [0, kStep], ArrowDown: [0, -kStep]} as Record<string, Knot>)[event.key];
    const inner = which > 0 && which < this.knots.length - 1;
    if (by) this.change(moved(this.knots, which, [this.knots[which]![0] + by[0], this.knots[which]![1] + by[1]]));
    else if (event.key === 'Insert' && which + 1 < this.knots.length) {
      const [[x0, y0], [x1, y1]] = [this.knots[which]!, this.knots[which + 1]!];
      this.change(inserted(this.knots, which + 1, [(x0 + x1) / 2, (y0 + y1) / 2]));
    } else if ((event.key === 'Delete' || event.key === 'Backspace') && inner) this.change(this.knots.filter((_, n) => n !== which));
    else return;
    event.preventDefault();
  }

  private change(knots: readonly Knot[]): void {
    this.knots = knots;
    this.draw();
    this.changed();
  }

  private draw(): void {
    const at = ([x, y]: Knot) => [kSize[0] * x, kSize[1] * (1 - y)] as const;
    set(this.line, 'points', this.knots.map(knot => at(knot).map(v => v.toFixed(1)).join()).join(' '));
    const {handles, knots} = this;
    while (handles.children.length > knots.length) handles.lastElementChild!.remove();
    while (handles.children.length < knots.length) {
      const which = handles.children.length;
      handles.append(svg('circle', {r: 5, tabindex: 0, role: 'slider', 'aria-valuemin': 0, 'aria-valuemax': 100, onkeydown: (event: KeyboardEvent) => this.key(event, which)}));
    }
    knots.forEach((knot, n) => {
      const [x, y] = at(knot);
      const percent = Math.round(100 * knot[1]);
      for (const [name, value] of Object.entries({cx: x.toFixed(1), cy: y.toFixed(1), 'aria-label': `Opacity at ${Math.round(100 * knot[0])} % of the range`, 'aria-valuenow': percent, 'aria-valuetext': `${percent} %`})) {
        set(handles.children[n]!, name, value);
      }
    });
  }
}
