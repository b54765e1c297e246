// SPDX-License-Identifier: Apache-2.0
// What is known of a volume beside its brightness: temperature and errors, chosen by name, with a bar that says which colour is what.
import type {VolumeLayer_Kind as Kind} from './api.gen';
import {el, set, setText, show} from './dom';
import {reading} from './format';
import type {Layer, Volume} from './wire';

const kKinds: Record<Exclude<Kind, 'KIND_UNSPECIFIED'>, {name: string; unit: string}> = {
  TEMPERATURE: {name: 'Temperature', unit: 'K'},
  TEMPERATURE_SIGMA: {name: 'Error of the temperature', unit: 'K'},
  EMISSION_SIGMA: {name: 'Error of the light', unit: 'levels / m'},
  EXTINCTION_SIGMA: {name: 'Error of the extinction', unit: '1/m'},
};
type Known = keyof typeof kKinds;
export type Shown = Known | 'BRIGHTNESS';

/** Dark to bright, also for who sees no colours: every eighth of Matplotlib's inferno. */
export const kHeat: readonly (readonly [number, number, number])[] =
  [[0, 0, 4], [31, 12, 72], [85, 15, 109], [136, 34, 106], [186, 54, 85], [227, 89, 51], [249, 140, 10], [249, 201, 50], [252, 255, 164]];

/** Of a value 0..255. */
export function heat(value: number): [number, number, number] {
  const at = Math.min(kHeat.length - 2, Math.floor(value / 255 * (kHeat.length - 1)));
  const part = value / 255 * (kHeat.length - 1) - at;
  const [from, to] = [kHeat[at]!, kHeat[at + 1]!];
  return [0, 1, 2].map(c => Math.round(from[c]! + part * (to[c]! - from[c]!))) as [number, number, number];
}

/** The voxels of the nth of a volume's layers, which follow those of its brightness. */
export function voxelsOf({nx, ny, nz}: Volume, bytes: Uint8Array, layer: number): Uint8Array {
  const size = nx * ny * nz;
  return bytes.subarray((layer + 1) * size, (layer + 2) * size);
}

/** Upright, through the middle, as seen along y: its colours are the bar's. */
export function paintSlice(canvas: HTMLCanvasElement, {nx, ny, nz}: Volume, values: Uint8Array): void {
  Object.assign(canvas, {width: nx, height: nz});
  const picture = new ImageData(nx, nz);
  const y = Math.floor(ny / 2);
  for (let z = 0; z < nz; ++z) {
    for (let x = 0; x < nx; ++x) {
      const value = values[x + nx * (y + ny * z)]!;
      picture.data.set(value > 0 ? [...heat(value), 255] : [0, 0, 0, 0], 4 * (x + nx * (nz - 1 - z)));
    }
  }
  canvas.getContext('2d')!.putImageData(picture, 0, 0);
}

export class Layers {
  private readonly select = el('select', {'aria-label': 'What is shown of the volume', onchange: () => {
    this.wish = this.select.value as Shown;
    this.changed();
  }});
  private readonly low = el('span', {class: 'low'});
  private readonly high = el('span', {class: 'high'});
  private readonly bar = el('p', {class: 'colour-bar'}, this.low, el('span', {class: 'colours', role: 'img', 'aria-label': 'from dark to bright'}), this.high);
  private readonly slice = el('canvas', {class: 'slice', role: 'img', width: 1, height: 1});
  private readonly note = el('p', {class: 'note'});
  private readonly measured = el('div', {}, this.bar, this.slice, this.note);
  private wish?: Shown;  // nobody's yet: temperature, where there is one
  readonly root = el('div', {class: 'layers', hidden: true}, el('label', {}, 'Show ', this.select), this.measured);

  constructor(private readonly changed: () => void) {}

  /** Of the next reconstruction nothing is chosen. */
  begin(): void {
    this.wish = undefined;
  }

  /** Shows what there is, and returns the voxels of the one that is chosen; none where that is brightness, as where this volume
   *  doesn't tell what is chosen. */
  show(volume: Volume, bytes: Uint8Array): Uint8Array | undefined {
    const known = (volume.layers ?? []).flatMap((layer, place) => layer.kind in kKinds ? [{...layer, place, kind: layer.kind as Known}] : []);
    show(this.root, known.length > 0);
    const options: [Shown, string][] = [['BRIGHTNESS', 'Brightness'], ...known.map(({kind}): [Shown, string] => [kind, kKinds[kind].name])];
    if (options.map(([kind]) => kind).join() !== [...this.select.options].map(({value}) => value).join()) {
      this.select.replaceChildren(...options.map(([value, name]) => el('option', {value}, name)));
    }
    const chosen = known.find(({kind}) => kind === (this.wish ?? 'TEMPERATURE'));
    this.select.value = chosen?.kind ?? 'BRIGHTNESS';
    set(this.root, 'data-shown', this.select.value);
    set(this.root, 'data-quick', chosen?.quick);
    show(this.measured, chosen !== undefined);
    if (!chosen) return undefined;
    this.tell(chosen);
    const values = voxelsOf(volume, bytes, chosen.place);
    paintSlice(this.slice, volume, values);
    return values;
  }

  private tell({kind, low, high, quick}: Layer & {kind: Known}): void {
    const {name, unit} = kKinds[kind];
    setText(this.low, `${reading(low)} ${unit}`);
    setText(this.high, `${reading(high)} ${unit}`);
    set(this.slice, 'aria-label', `${name}, a slice through the middle`);
    setText(this.note, quick ? 'A slice through the middle, looked up by this iteration’s colours. The result’s is better, and has its error.'
                             : 'A slice through the middle. Where nothing is drawn, it isn’t told.');
  }
}
