// SPDX-License-Identifier: Apache-2.0
import {defineConfig} from 'vite';

// One script and one style sheet, which `emberlock view` puts into the page it writes.
export default defineConfig({
  publicDir: false,
  build: {
    target: 'es2022',
    emptyOutDir: false,  // beside the console
    reportCompressedSize: false,
    lib: {entry: 'src/viewer/main.ts', name: 'emberlock', formats: ['iife'], fileName: () => 'viewer.js', cssFileName: 'viewer'},
  },
});
