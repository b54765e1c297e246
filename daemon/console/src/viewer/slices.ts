// SPDX-License-Identifier: Apache-2.0
// Slices through a quantity across x, y and z, with a colour bar, isotherms as lines, and the value below the pointer.
import {el, setText} from '../dom';
import {heat} from '../layers';
import type {Triple} from './contents';
import type {GridPlace} from './march';

/** What is drawn in a slice: values from low to high, lines at levels. Values that aren't above 0 aren't told. */
export interface Told {
  grid: GridPlace;
  values: Float32Array;
  unit: string;
  low: number;
  high: number;
  levels: readonly number[];
}

const kNames = ['x', 'y', 'z'] as const;
type AxisIndex = 0 | 1 | 2;

/** The axes to the right and upwards in a slice, and whether the latter points down: what is up in the world is up. */
export function axesOf(across: AxisIndex, up: Triple): {right: AxisIndex; upwards: AxisIndex; down: boolean} {
  const vertical = up.map(Math.abs).indexOf(Math.max(...up.map(Math.abs))) as AxisIndex;
  const [first, second] = ([0, 1, 2] as const).filter(axis => axis !== across) as [AxisIndex, AxisIndex];
  return vertical === first ? {right: second, upwards: first, down: up[vertical] < 0}
                            : {right: first, upwards: second, down: vertical === second && up[vertical] < 0};
}

/** A value with its unit, in as many digits as can be read. */
export function words(value: number, unit: string): string {
  const digits = Math.abs(value) >= 1000 || value === 0 ? 0 : Math.max(0, 3 - Math.ceil(Math.log10(Math.abs(value))));
  return `${value.toFixed(Math.min(20, digits))} ${unit}`;
}

class Slice {
  private readonly canvas = el('canvas', {class: 'slice', role: 'img', width: 1, height: 1});
  private readonly slider: HTMLInputElement;
  private readonly label = el('span');
  private told?: Told;
  readonly root: HTMLElement;

  private readonly axes: ReturnType<typeof axesOf>;

  constructor(private readonly axis: AxisIndex, up: Triple, private readonly say: (text: string) => void) {
    this.axes = axesOf(axis, up);
    this.slider = el('input', {type: 'range', min: 0, max: 1, step: 1, 'aria-label': `Place of the slice across ${kNames[axis]}`, oninput: () => this.draw()});
    this.canvas.addEventListener('pointermove', event => this.point(event));
    this.canvas.addEventListener('pointerleave', () => say(''));
    this.root = el('figure', {}, this.canvas, el('figcaption', {}, this.label, this.slider));
  }

  show(told: Told): void {
    const last = told.grid.points[this.axis] - 1;
    if (!this.told || last !== Number(this.slider.max)) {
      this.slider.max = String(last);
      this.slider.value = String(Math.round(last / 2));
    }
    this.told = told;
    this.draw();
  }

  private at(right: number, up: number): number {
    const {points} = this.told!.grid;
    const place = [0, 0, 0];
    const {upwards, down} = this.axes;
    [place[this.axis], place[this.axes.right], place[upwards]] = [this.slider.valueAsNumber, right, down ? points[upwards] - 1 - up : up];
    return this.told!.values[place[0]! + points[0] * (place[1]! + points[1] * place[2]!)]!;
  }

  private draw(): void {
    const {grid, low, high, levels, unit} = this.told!;
    const [width, height] = [grid.points[this.axes.right], grid.points[this.axes.upwards]];
    const place = grid.origin[this.axis] + grid.edge * this.slider.valueAsNumber;
    setText(this.label, `across ${kNames[this.axis]} at ${(1000 * place).toFixed(1)} mm`);
    Object.assign(this.canvas, {width, height});
    const picture = new ImageData(width, height);
    for (let up = 0; up < height; ++up) {
      for (let right = 0; right < width; ++right) {
        const value = this.at(right, up);
        if (!(value > 0)) continue;
        const beside = [right + 1 < width ? this.at(right + 1, up) : value, up + 1 < height ? this.at(right, up + 1) : value];
        const crossed = levels.some(level => beside.some(other => other > 0 && (value < level) !== (other < level)));
        const share = Math.max(0, Math.min(1, (value - low) / (high - low || 1)));
        picture.data.set(crossed ? [255, 255, 255, 255] : [...heat(255 * share), 255], 4 * (right + width * (height - 1 - up)));
      }
    }
    this.canvas.getContext('2d')!.putImageData(picture, 0, 0);
    this.canvas.setAttribute('aria-label', `A slice across ${kNames[this.axis]} at ${(1000 * place).toFixed(1)} mm, ${words(low, unit)} dark to ${words(high, unit)} bright`);
  }

  private point(event: PointerEvent): void {
    if (!this.told) return;
    const {width, height} = this.canvas;
    const box = this.canvas.getBoundingClientRect();
    const share = Math.min(box.width / width, box.height / height);  // object-fit: contain
    const right = Math.floor((event.clientX - box.left - (box.width - share * width) / 2) / share);
    const up = height - 1 - Math.floor((event.clientY - box.top - (box.height - share * height) / 2) / share);
    if (right < 0 || up < 0 || right >= width || up >= height) return this.say('');
    const value = this.at(right, up);
    this.say(value > 0 ? words(value, this.told.unit) : 'not told');
  }
}

export class Slices {
  private readonly below = el('output', {class: 'below'});
  private readonly slices: Slice[];
  readonly root: HTMLElement;

  /** `up` points up in the world. */
  constructor(up: Triple) {
    this.slices = ([0, 1, 2] as const).map(axis => new Slice(axis, up, text => setText(this.below, text)));
    this.root = el('div', {class: 'slices-part'}, el('div', {class: 'slices'}, ...this.slices.map(slice => slice.root)), this.below);
  }

  show(told: Told): void {
    for (const slice of this.slices) slice.show(told);
  }
}
