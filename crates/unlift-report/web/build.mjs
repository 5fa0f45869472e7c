// Bundles vendor.mjs into vendor/bundle.min.js, copies the licenses and writes VENDOR.md.
// Run it by hand after a change of a version:  npm ci && npm run build
import { createHash } from "node:crypto";
import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const out = "vendor";
mkdirSync(out, { recursive: true });

const result = await build({
  entryPoints: ["vendor.mjs"],
  bundle: true,
  minify: true,
  format: "iife",
  globalName: "UnliftVendor",
  target: "es2020",
  charset: "ascii",
  legalComments: "inline",
  define: { "process.env.NODE_ENV": '"production"' },
  write: false,
});
const text = result.outputFiles[0].text;
// The bundle is inlined into a page, so it must not open or close a script element.
for (const mark of ["</script", "<!--", "<script"]) {
  if (text.toLowerCase().includes(mark)) throw new Error(`the bundle contains ${mark}`);
}
writeFileSync(`${out}/bundle.min.js`, text);

const licences = {
  echarts: ["LICENSE", "NOTICE", "licenses/LICENSE-d3"],
  zrender: ["LICENSE"],
  tslib: ["LICENSE.txt"],
  three: ["LICENSE"],
};
const spdx = { echarts: "Apache-2.0", zrender: "BSD-3-Clause", tslib: "0BSD", three: "MIT" };
const lock = JSON.parse(readFileSync("package-lock.json", "utf8")).packages;
const rows = [];
for (const [name, files] of Object.entries(licences)) {
  for (const file of files) {
    const base = file.split("/").pop().replace(/\.txt$/, "");
    copyFileSync(`node_modules/${name}/${file}`, `${out}/${base}-${name}`.replace("-d3-echarts", "-d3"));
  }
  const entry = lock[`node_modules/${name}`];
  rows.push(`| ${name} | ${entry.version} | ${spdx[name]} | \`${entry.integrity}\` |`);
}
const sha256 = createHash("sha256").update(text).digest("hex");
const esbuild = lock["node_modules/esbuild"];
writeFileSync(
  `${out}/VENDOR.md`,
  `# What is in \`bundle.min.js\`

Written by \`../build.mjs\` (\`npm ci && npm run build\` in \`web/\`); do not edit by hand. Cargo never runs npm.

| package | version | licence | npm integrity |
| --- | --- | --- | --- |
${rows.join("\n")}

Bundled and minified by esbuild ${esbuild.version} (\`${esbuild.integrity}\`).
Licence texts lie beside this file. ECharts also contains code of d3 (\`LICENSE-d3\`).

- \`bundle.min.js\`: ${text.length} bytes
- sha256: \`${sha256}\`
`,
);
console.log(`${out}/bundle.min.js: ${text.length} bytes, sha256 ${sha256}`);
