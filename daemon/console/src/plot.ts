// SPDX-License-Identifier: Apache-2.0
// Lines over time by uPlot, in colours that colour-blind people tell apart (Okabe and Ito), and dashed where those repeat.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';

import {el} from './dom';

export const lineColours = ['#56b4e9', '#e69f00', '#009e73', '#f0e442', '#d55e00', '#cc79a7', '#e8edf2'];
const dashes: number[][] = [[], [8, 4], [2, 3], [10, 3, 2, 3]];

export interface Line {
  name: string;
  colour?: string;
}

export interface PlotOptions {
  x: string;
  y: string;
  lines: Line[];
  /** Linear within this, logarithmic beyond: errors of thousands of rows beside a tolerance of a hundred. */
  linear?: number;
  band?: number;  // either side of 0
  tick?: (value: number) => string;
}

/** 0, the tolerance, and powers of ten beyond it, either side. */
function ticksAround(linear: number, scale: {min?: number; max?: number}): number[] {
  const reach = Math.max(-(scale.min ?? 0), scale.max ?? 0);
  const ticks = [0, linear];
  for (let tick = 10 ** Math.ceil(Math.log10(3 * linear)); tick <= reach; tick *= 10) ticks.push(tick);
  return [...ticks.slice(1).reverse().map(tick => -tick), ...ticks].filter(tick => tick >= (scale.min ?? 0) && tick <= (scale.max ?? 0));
}

/** The names without what all begin with, where that ends at a "-", "_" or space. */
export function shortNames(names: string[]): string[] {
  const first = names[0] ?? '';
  let common = 0;
  while (common < first.length && names.every(name => name[common] === first[common])) ++common;
  const begin = Math.max(...['-', '_', ' '].map(mark => first.lastIndexOf(mark, common - 1))) + 1;
  return names.length > 1 ? names.map(name => name.slice(begin)) : names;
}

export class Plot {
  readonly root = el('div', {class: 'plot'});
  private readonly chart = el('div', {class: 'chart'});
  private readonly legend = el('ul', {class: 'legend'});
  private uplot?: uPlot;
  private key = '';
  private band = 0;
  private data: uPlot.AlignedData = [[]];

  constructor(label: string) {
    this.root.append(this.chart, this.legend);
    this.chart.setAttribute('role', 'img');
    this.chart.setAttribute('aria-label', label);
    new ResizeObserver(() => this.resize()).observe(this.chart);
  }

  show(options: PlotOptions, data: (number | null)[][]): void {
    const key = JSON.stringify([options.x, options.y, options.lines, options.linear]);
    this.band = options.band ?? 0;
    this.data = data as unknown as uPlot.AlignedData;
    if (key !== this.key || !this.uplot) this.build(options, key);
    else this.uplot.setData(this.data);
  }

  private build(options: PlotOptions, key: string): void {
    this.key = key;
    this.uplot?.destroy();
    const lines = options.lines.map((line, place) => ({
      colour: line.colour ?? lineColours[place % lineColours.length]!,
      dash: dashes[Math.floor(place / lineColours.length) % dashes.length]!,
    }));
    const axis = {stroke: '#b4bfcc', grid: {stroke: '#242c38', width: 1}, ticks: {stroke: '#3a4656', width: 1},
                  font: '13px system-ui, sans-serif', labelFont: '13px system-ui, sans-serif', labelSize: 20};
    const {tick, linear} = options;
    this.uplot = new uPlot({
      ...this.size(),
      legend: {show: false},
      cursor: {show: false},
      scales: {x: {time: false}, y: options.linear ? {distr: 4, asinh: options.linear, range: (_: uPlot, least: number, most: number) => this.around(least, most)} : {}},
      axes: [{...axis, label: options.x, size: 34},
             {...axis, label: options.y, size: 58, ...(linear ? {splits: (plot: uPlot) => ticksAround(linear, plot.scales.y!), filter: (_: uPlot, splits: number[]) => splits} : {}),
              ...(tick ? {values: (_: uPlot, values: number[]) => values.map(v => (v === null ? '' : tick(v)))} : {})}],
      series: [{}, ...lines.map(line => ({stroke: line.colour, width: 2, dash: line.dash, points: {show: true, size: 5, fill: line.colour}, spanGaps: true}))],
      hooks: {drawAxes: [plot => this.drawBand(plot)]},
    }, this.data, this.chart);
    const names = shortNames(options.lines.map(line => line.name));
    this.legend.replaceChildren(...options.lines.map((_, place) => {
      const swatch = el('canvas', {width: 44, height: 12, 'aria-hidden': 'true'});
      const context = swatch.getContext('2d')!;
      context.strokeStyle = lines[place]!.colour;
      context.lineWidth = 4;
      context.setLineDash(lines[place]!.dash);
      context.moveTo(0, 6);
      context.lineTo(44, 6);
      context.stroke();
      return el('li', {}, swatch, names[place]!);
    }));
  }

  private drawBand(plot: uPlot): void {
    if (this.band <= 0) return;
    const {left, width, top, height} = plot.bbox;
    const clamp = (y: number) => Math.max(top, Math.min(top + height, y));
    const upper = clamp(plot.valToPos(this.band, 'y', true));
    const lower = clamp(plot.valToPos(-this.band, 'y', true));
    plot.ctx.save();
    plot.ctx.fillStyle = 'rgba(0, 158, 115, 0.22)';
    plot.ctx.fillRect(left, upper, width, lower - upper);
    plot.ctx.restore();
  }

  /** All values, and the band with some room. */
  private around(least: number, most: number): [number, number] {
    return [Math.min(1.1 * (least ?? 0), -1.5 * this.band), Math.max(1.1 * (most ?? 0), 1.5 * this.band)];
  }

  private size(): {width: number; height: number} {
    return {width: Math.max(120, this.chart.clientWidth), height: Math.max(100, this.chart.clientHeight)};
  }

  private resize(): void {
    this.uplot?.setSize(this.size());
  }
}
