// Makes plotly.min.js.gz: plotly.js with the kinds of charts that the pages of reports have, built
// with the settings of plotly.js's own bundles. package.json says how to run it.
import { build } from 'esbuild';
import { environmentPlugin } from 'esbuild-plugin-environment';
import { glsl } from 'esbuild-plugin-glsl';
import inlineCss from 'esbuild-plugin-inline-css';
import { readFileSync, writeFileSync } from 'node:fs';
import { gzipSync } from 'node:zlib';

const KINDS = ['heatmap', 'mesh3d', 'parcoords', 'scatter3d']; // scatter is part of the core
const { version } = JSON.parse(readFileSync('node_modules/plotly.js/package.json'));
const parts = KINDS.map((kind) => `require('plotly.js/lib/${kind}')`);
const result = await build({
    stdin: {
        contents: `const Plotly = require('plotly.js/lib/core');
            Plotly.register([${parts}]);
            window.Plotly = Plotly;`,
        resolveDir: '.'
    },
    bundle: true,
    format: 'iife',
    minify: true,
    write: false,
    plugins: [inlineCss(), glsl({ minify: true }), environmentPlugin({ NODE_DEBUG: false })],
    alias: { regl: '@plotly/regl', stream: 'stream-browserify' },
    define: { global: 'window', 'define.amd': 'false' },
    target: 'es2016',
    banner: {
        js: `/*! plotly.js v${version} (${['scatter', ...KINDS].join(', ')}), ` +
            'Copyright 2012-2026, Plotly, Inc., licensed under the MIT license */'
    }
});
writeFileSync('plotly.min.js.gz', gzipSync(result.outputFiles[0].contents, { level: 9 }));
