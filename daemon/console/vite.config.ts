// SPDX-License-Identifier: Apache-2.0
import {defineConfig} from 'vite';

// Served by emberlockd from share/emberlock/console, or by `npm run dev` in front of one that runs (EMBERLOCK_URL).
export default defineConfig({
  base: './',
  build: {
    target: 'es2022',
    emptyOutDir: true,
    reportCompressedSize: false,
    modulePreload: {polyfill: false},
  },
  server: {proxy: Object.fromEntries(['/api', '/open'].map(path => [path, {target: process.env.EMBERLOCK_URL ?? 'http://127.0.0.1:8741', ws: true}]))},
});
