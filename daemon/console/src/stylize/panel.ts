// SPDX-License-Identifier: Apache-2.0
// A stylization as it runs: a view's picture to be edited, beside it what the volume shows there, the tools, and undo.
import './style.css';

import {act} from '../act';
import type {Box, DaemonStatus, IterationPreview, StylizationStatus, StylizationStatus_View as ViewOf} from '../api.gen';
import {el, set, setText, show} from '../dom';
import {fixed, plural} from '../format';
import {Sign} from '../light';
import {bitmapOf, paint} from '../picture';
import {call, type View, type Volume} from '../wire';
import {Brush} from './brush';
import {Curve} from './curve';
import {order} from './fields';
import {Mask} from './mask';
import {ObjectTool} from './object';
import {Pad} from './pad';
import {RegionTool} from './region';
import type {Bench, Operation, Pictures, Tool} from './tool';

const kLate = 2000;  // ms for a step that was taken to be seen, after which it isn't waited for

/** A canvas that shows its newest JPEG, however long each takes to be decoded. */
class Newest {
  private asked = 0;
  private shown = 0;

  constructor(readonly canvas: HTMLCanvasElement) {}

  /** False: a later one was quicker. */
  async show(jpeg: Uint8Array): Promise<boolean> {
    const turn = ++this.asked;
    const bitmap = await bitmapOf(jpeg);
    if (turn < this.shown) {
      bitmap.close();
      return false;
    }
    this.shown = turn;
    paint(this.canvas, bitmap);
    return true;
  }
}

export class Panel implements Bench {
  private readonly sign = new Sign('GREEN');
  private readonly word = el('span', {class: 'word'});
  private readonly doing = el('p', {role: 'status'});
  private readonly undo = order('Undo', () => void this.send({op: 'undo'}));
  private readonly redo = order('Redo', () => void this.send({op: 'redo'}));
  private readonly finish = order('Finish', () => void act(call('Reconstruct/Finish')), 'primary');
  private readonly views = el('select', {onchange: () => this.look()});
  private readonly pad = new Pad();
  private readonly edited = new Newest(this.pad.picture);
  private readonly rendered = new Newest(el('canvas', {width: 4, height: 3, class: 'stylized', role: 'img', 'aria-label': 'The volume as this view sees it'}));
  private readonly captions = {captured: el('figcaption', {}, 'Input picture, as edited'), rendered: el('figcaption', {}, 'The volume, as this view sees it')};
  private readonly tools: Tool[] = [new Brush(this), new ObjectTool(this), new Mask(this), new RegionTool(this), new Curve(this)];
  private readonly hint = el('p', {class: 'note tool-hint', id: 'stylize-hint'});
  private readonly place = el('div', {class: 'tool'});
  private readonly waiting = new Set<(passes: number) => void>();
  private tool = this.tools[0]!;
  private queue: Promise<unknown> = Promise.resolve();
  private id = '';
  private now?: StylizationStatus;
  private previewed?: StylizationStatus;  // what the pictures that come next show
  box: Box | undefined;
  readonly root: HTMLElement;

  constructor() {
    const choices = this.tools.flatMap((tool, at) => {
      const id = `stylize-tool-${at}`;
      return [el('input', {type: 'radio', name: 'stylize-tool', id, checked: at === 0, onchange: () => this.use(tool)}), el('label', {for: id}, tool.name)];
    });
    set(this.pad.root, 'aria-describedby', 'stylize-hint');
    this.root = el('section', {id: 'stylization', class: 'panel', 'aria-labelledby': 'stylization-title', hidden: true},
      el('header', {}, this.sign.root, el('h2', {id: 'stylization-title'}, 'Stylization'), this.word, this.doing,
        el('span', {class: 'stylize-orders'}, this.undo, this.redo, this.finish)),
      el('div', {class: 'stylize'},
        el('div', {class: 'tools'},
          el('label', {class: 'field'}, el('span', {}, 'View'), this.views),
          el('fieldset', {class: 'choice tool-choice'}, el('legend', {class: 'hidden'}, 'Tool'), ...choices), this.hint, this.place),
        el('figure', {}, this.pad.root, this.captions.captured), el('figure', {}, this.rendered.canvas, this.captions.rendered)),
      el('p', {class: 'note'}, 'Finish writes the volume and the steps, which replay it. Cancel, below, throws both away.'));
    this.root.addEventListener('keydown', event => this.key(event));
    new ResizeObserver(() => this.pad.draw()).observe(this.pad.root);
    this.use(this.tool);
  }

  get view(): ViewOf | undefined {
    return this.now?.views.find(({name}) => name === this.now!.view);
  }

  get inputs(): readonly ViewOf[] {
    return this.now?.views.filter(view => !view.held_out) ?? [];
  }

  show(status: DaemonStatus): void {
    const r = status.reconstruction;
    const runs = r?.state === 'RUNNING' && r.stylization !== undefined;
    show(this.root, runs);
    if (!runs) return;
    this.begin(r.id);
    setText(this.doing, [r.session, r.device && `on ${r.device}`].filter(Boolean).join(' · '));
    // Previews are ahead of it.
    if (!this.now || r.stylization!.passes > this.now.passes) this.take(r.stylization!);
    else if (this.now.views.length === 0) this.take({...this.now, views: r.stylization!.views});
  }

  preview({reconstruction, stylization}: IterationPreview): void {
    if (!stylization) return;
    this.begin(reconstruction);
    this.previewed = stylization;
    this.take(stylization);
  }

  async picture(header: View, jpeg: Uint8Array): Promise<void> {
    if (!this.previewed) return;
    const {steps, view, passes} = this.previewed;
    const picture = header.kind === 'captured' ? this.edited : this.rendered;
    if (!await picture.show(jpeg)) return;
    set(picture.canvas, 'data-steps', steps);
    set(picture.canvas, 'data-view', view);
    setText(this.captions[header.kind], header.kind === 'captured' ? `Input picture of ${view}, as edited`
      : `The volume, as ${view} sees it, after ${plural(passes, 'pass', 'passes')}`);
    this.pad.draw();
    if (header.kind === 'rendered') for (const tell of [...this.waiting]) tell(passes);
  }

  volume({box}: Volume): void {
    const now = {center: box?.center ?? [], size: box?.size ?? []};
    if (now.center.length !== 3 || JSON.stringify(now) === JSON.stringify(this.box)) return;
    this.box = now;
    for (const tool of this.tools) tool.changed?.();
  }

  redraw(): void {
    this.pad.draw();
  }

  send(operation: Operation, pictures?: Pictures): Promise<boolean> {
    const step = this.queue.then(() => act(call('Reconstruct/Edit', {operation: JSON.stringify(operation), ...pictures})));
    this.queue = step;
    return step.then(async answer => {
      if (!answer) return false;
      this.answered(answer);
      await this.seenAfter(answer.passes);
      return true;
    });
  }

  /** Until a preview shows more passes than these. */
  private seenAfter(before: number): Promise<void> {
    if ((this.previewed?.passes ?? 0) > before) return Promise.resolve();
    return new Promise(resolve => {
      const heard = (passes: number): void => {
        if (passes <= before) return;
        this.waiting.delete(heard);
        clearTimeout(timer);
        resolve();
      };
      const timer = setTimeout(() => heard(Infinity), kLate);
      this.waiting.add(heard);
    });
  }

  private look(): void {
    const view = this.views.value;
    this.queue = this.queue.then(() => act(call('Reconstruct/Edit', {view}))).then(answer => this.answered(answer ?? this.now!));
  }

  /** By another way than previews, one of which may have come before and know more. */
  private answered(status: StylizationStatus): void {
    if (!this.previewed || status.passes >= this.previewed.passes) this.take(status);
  }

  private begin(id: string): void {
    if (id === this.id) return;
    this.id = id;
    this.now = this.previewed = undefined;
  }

  private take(status: StylizationStatus): void {
    const before = this.view?.name;
    this.now = {...status, views: status.views.length > 0 ? status.views : this.now?.views ?? []};
    const {views, view, passes, residual, steps, undone, pauses} = this.now;
    this.sign.show(pauses ? 'LIGHT_UNSPECIFIED' : 'GREEN');
    setText(this.word, `${pauses ? 'waits for a step' : 'goes on'} · ${plural(passes, 'pass', 'passes')} · ${plural(steps, 'step')}${passes > 0 ? ` · residual ${fixed(residual, 2)} of 255` : ''}`);
    this.undo.disabled = steps === 0;
    this.redo.disabled = undone === 0;
    if (this.views.options.length !== views.length) {
      this.views.replaceChildren(...views.map(({name, held_out}) => el('option', {value: name, disabled: held_out}, held_out ? `${name}: held out` : name)));
    }
    this.views.value = view;
    if (this.view?.name !== before) for (const tool of this.tools) tool.changed?.();
    this.pad.show(this.view, this.tool);
  }

  private use(tool: Tool): void {
    this.tool = tool;
    setText(this.hint, tool.hint);
    this.place.replaceChildren(tool.root);
    this.pad.show(this.view, tool);
  }

  private key(event: KeyboardEvent): void {
    if (!event.ctrlKey && !event.metaKey) return;
    if ((event.target as HTMLElement).matches('input:not([type=radio], [type=checkbox], [type=file])')) return;  // a field has an undo of its own
    const key = event.key.toLowerCase();
    const button = key === 'y' || (key === 'z' && event.shiftKey) ? this.redo : key === 'z' ? this.undo : undefined;
    if (!button) return;
    event.preventDefault();
    button.click();
  }
}
