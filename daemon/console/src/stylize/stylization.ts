// SPDX-License-Identifier: Apache-2.0
// The panel of a stylization, which is loaded when the first one runs; what comes meanwhile waits for it, in its order.
import type {DaemonStatus, IterationPreview} from '../api.gen';
import {el} from '../dom';
import type {View, Volume} from '../wire';
import type {Panel} from './panel';

export class Stylization {
  private panel?: Promise<Panel | undefined>;
  readonly root = el('div', {class: 'later'});

  show(status: DaemonStatus): void {
    if (status.reconstruction?.stylization) this.load();
    void this.panel?.then(panel => panel?.show(status));
  }

  preview(preview: IterationPreview): void {
    if (preview.stylization) this.load();
    void this.panel?.then(panel => panel?.preview(preview));
  }

  volume(header: Volume): void {
    void this.panel?.then(panel => panel?.volume(header));
  }

  picture(header: View, jpeg: Uint8Array): void {
    void this.panel?.then(panel => panel?.picture(header, jpeg));
  }

  private load(): void {
    this.panel ??= import('./panel').then(module => {
      const panel = new module.Panel();
      this.root.replaceChildren(panel.root);
      return panel;
    }).catch((error: unknown) => {
      this.root.replaceChildren(el('p', {class: 'panel', role: 'alert'}, `The stylization can't be edited here: ${String(error)}. Load the page again.`));
      return undefined;
    });
  }
}
