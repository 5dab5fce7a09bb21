import { defineConfig } from "vite";

// Script and style of a page to share, which the program puts into one file with the scene.
export default defineConfig({
  base: "./",
  build: {
    outDir: "../crates/refraxel/assets/share",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: false,
    cssCodeSplit: false,
    rollupOptions: {
      input: "share/main.ts",
      output: { entryFileNames: "page.js", assetFileNames: "page[extname]", codeSplitting: false },
    },
  },
});
