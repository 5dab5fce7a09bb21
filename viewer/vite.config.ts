import { defineConfig } from "vite";

// Three files with fixed names, which the program embeds.
export default defineConfig({
  base: "./",
  build: {
    outDir: "../crates/refraxel/assets/viewer",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: false,
    rollupOptions: {
      output: {
        entryFileNames: "page.js",
        assetFileNames: "page[extname]",
        codeSplitting: false,
      },
    },
  },
});
