// SPDX-License-Identifier: Apache-2.0
// What alignment saw, drawn over a picture in the camera's own pixels: lamp, dots, the row where the dot should be, the band.
import type {CameraStatus} from './api.gen';
import {set, show, svg} from './dom';
import {known} from './format';

export class Overlay {
  private readonly bands = svg('g', {class: 'bands'});
  private readonly target = svg('line', {class: 'target', x1: 0});
  private readonly lamp = svg('circle', {class: 'lamp'});
  private readonly dots = svg('g', {class: 'dots'});
  readonly root = svg('svg', {class: 'overlay', 'aria-hidden': 'true'}, this.bands, this.target, this.lamp, this.dots);

  show(camera: CameraStatus): void {
    const {width, height, target_row: row, band, lamp, lamp_radius: radius, dots} = camera;
    set(this.root, 'viewBox', `0 0 ${width || 16} ${height || 9}`);
    show(this.target, known(row));
    if (known(row)) {
      for (const [name, value] of [['x2', width], ['y1', row + 0.5], ['y2', row + 0.5]] as const) set(this.target, name, value);
    }
    while (this.bands.children.length > band.length) this.bands.lastElementChild!.remove();
    while (this.bands.children.length < band.length) this.bands.append(svg('rect', {class: 'band', x: 0}));
    band.forEach(({first, last}, place) => {
      for (const [name, value] of [['width', width], ['y', first + 0.5], ['height', last - first]] as const) set(this.bands.children[place]!, name, value);
    });
    show(this.lamp, lamp !== undefined);
    if (lamp) {
      for (const [name, value] of [['cx', lamp.x + 0.5], ['cy', lamp.y + 0.5], ['r', radius ?? 4]] as const) set(this.lamp, name, value);
    }
    const size = Math.max(3, (height || 9) / 40);
    while (this.dots.children.length > dots.length) this.dots.lastElementChild!.remove();
    while (this.dots.children.length < dots.length) this.dots.append(svg('path'));
    dots.forEach((dot, place) => {
      set(this.dots.children[place]!, 'd', `M${dot.x + 0.5} ${dot.y + 0.5 - size}l${size} ${size}l${-size} ${size}l${-size} ${-size}z`);
    });
  }
}

/** A needle over the band: where the error stands within three tolerances, readable from afar. */
export class Gauge {
  private readonly needle = svg('path', {class: 'needle', d: 'M0 0l-5 -9h10z'});
  readonly root = svg('svg', {class: 'gauge', viewBox: '-100 -10 200 20', preserveAspectRatio: 'none', 'aria-hidden': 'true'},
                      svg('rect', {class: 'scale', x: -100, y: 0, width: 200, height: 8}),
                      svg('rect', {class: 'inside', x: -100 / 3, y: 0, width: 200 / 3, height: 8}),
                      svg('line', {class: 'middle', x1: 0, x2: 0, y1: 0, y2: 8}), this.needle);

  show(error: number | undefined, tolerance: number | undefined): void {
    const shown = known(error) && known(tolerance) && tolerance > 0;
    show(this.needle, shown);
    if (shown) set(this.needle, 'transform', `translate(${(gaugePlace(error, tolerance) * 100).toFixed(1)} 0)`);
  }
}

/** Of half the gauge: linear to nearly three tolerances either side, where it stays. */
export function gaugePlace(error: number, tolerance: number): number {
  return Math.max(-0.95, Math.min(0.95, error / (3 * tolerance)));
}
