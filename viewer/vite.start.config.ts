import { defineConfig } from "vite";

// The start page: three files with fixed names, which the program embeds.
export default defineConfig({
  root: "start",
  base: "./",
  build: {
    outDir: "../../crates/refraxel/assets/start",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: false,
    rollupOptions: {
      output: { entryFileNames: "page.js", assetFileNames: "page[extname]", codeSplitting: false },
    },
  },
});
