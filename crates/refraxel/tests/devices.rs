//! Devices on the command line. What needs an adapter runs with the feature `gpu` on any machine that has one, be it a
//! software one: `cargo test -p refraxel --features gpu --test devices -- --ignored`.

mod common;

use common::{Ran, ball_and, refraxel, train};
use std::path::Path;

const STRAIGHT: [&str; 2] = ["--refraction", "off"];

fn straight(data: &Path, run: &Path, more: &[&str]) -> Ran {
    train(data, run, &[&STRAIGHT[..], more].concat())
}

#[test]
fn a_device_that_nobody_knows_is_refused() {
    refraxel(&["train", "a", "--out", "b", "--device", "cuda"]).refused(2, &["cuda", "auto, cpu, gpu"]);
    refraxel(&["inspect", "a", "--devices"]).refused(2, &["cannot be used with"]);
}

#[test]
fn the_device_of_a_run_is_in_its_scores() {
    let (_folder, data, run) = ball_and("run");
    let scores = straight(&data, &run, &["--device", "cpu", "--json"]).done().json();
    assert_eq!(scores["run"]["device"]["name"], "cpu");
    assert!(log(&run).contains(r#""event":"device_chosen","device":{"name":"cpu"}"#));
}

#[cfg(not(feature = "gpu"))]
#[test]
fn without_gpus_the_program_says_how_to_get_them_before_it_works() {
    let (_folder, data, run) = ball_and("run");
    straight(&data, &run, &["--device", "gpu"])
        .refused(6, &["--locked --path crates/refraxel --features gpu", "--device cpu"]);
    assert!(!run.exists());
    refraxel(&["inspect", "--devices"]).refused(6, &["--features gpu"]);
    refraxel(&["bench", "--quick", "--device", "gpu:0"]).refused(6, &["--features gpu"]);
}

fn log(run: &Path) -> String {
    std::fs::read_to_string(run.join("log.jsonl")).unwrap()
}

#[cfg(feature = "gpu")]
mod gpu {
    use super::*;
    use common::{ball, path, refractive, train_with_index};
    use refraxel::device::{Decided, Gpu, Opened};
    use refraxel::progress::Show;
    use refraxel::viewer::{Look, Scene};
    use refraxel_core::{Ray, vec3};
    use refraxel_data::photographs::stored_pixels;
    use refraxel_train::Backend;
    use refraxel_train::backend::Layers;
    use refraxel_train::bench::{BenchGrid, model};
    use refraxel_train::device::{Device, DeviceChoice};
    use refraxel_train::run::Run;
    use serde_json::{Value, json};
    use std::path::PathBuf;

    /// The adapters of this machine.
    fn adapters() -> Vec<Value> {
        let listed = refraxel(&["inspect", "--devices", "--json"]).done().json();
        listed["adapters"].as_array().unwrap().clone()
    }

    fn psnr(scores: &Value) -> f64 {
        scores["psnr"].as_f64().unwrap()
    }

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn adapters_are_listed_with_their_limits() {
        let first = &adapters()[0];
        assert_eq!(first["number"], 0);
        assert!(first["max_binding"].as_u64().unwrap() >= 128 << 20, "{first}");
        assert!(first["memory"].as_u64().is_some_and(|bytes| bytes > 1 << 26), "{first}");
        let text = refraxel(&["inspect", "--devices"]).done().out;
        assert!(text.contains("gpu:0 ") && text.contains(first["name"].as_str().unwrap()), "{text}");
        let number = adapters().len().to_string();
        refraxel(&["bench", "--quick", "--device", &format!("gpu:{number}")])
            .refused(6, &["there is no adapter", "gpu:0 is"]);
    }

    #[test]
    #[ignore = "needs a software adapter and no other one"]
    fn a_software_adapter_is_taken_by_its_number_only() {
        assert!(adapters().iter().all(|a| a["kind"] == "software"), "this machine has more");
        let (_folder, data, run) = ball_and("run");
        straight(&data, &run, &["--device", "gpu"])
            .refused(6, &["no usable GPU", "runs on the CPU", "--device cpu"]);
        assert!(!run.exists());
        let scores = straight(&data, &run, &["--json"]).done().json();
        assert_eq!(scores["run"]["device"]["name"], "cpu");
    }

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn a_run_begins_on_either_device_and_goes_on_on_the_other() {
        // Runs that round otherwise part company in forty steps, and stay this near [dB].
        const TOL: f64 = 0.3;
        let folder = tempfile::tempdir().unwrap();
        let data = ball(folder.path());
        let of = |name: &str, more: &[&str]| straight(&data, &folder.path().join(name), more);
        let cpu = psnr(&of("cpu", &["--device", "cpu", "--json"]).done().json());
        let halted = ["--set", "run.stop_after=20"];
        let on = ["--resume", "--set", "run.stop_after=0", "--json"];
        for (name, first, then) in
            [("there", "cpu", "gpu:0"), ("back", "gpu:0", "cpu"), ("gpu", "gpu:0", "gpu:0")]
        {
            of(name, &[&["--device", first], &halted[..]].concat()).refused(130, &["stopped at step 20"]);
            let scores = of(name, &[&["--device", then], &on[..]].concat()).done().json();
            assert!((psnr(&scores) - cpu).abs() < TOL, "{name}: {} and {cpu} dB", psnr(&scores));
            let device = scores["run"]["device"]["name"].as_str().unwrap();
            assert_eq!(device == "cpu", then == "cpu", "{device}");
            assert_eq!(log(&folder.path().join(name)).matches("device_chosen").count(), 2);
        }
    }

    /// A whole training with stages, in which field, index and surface learn from paths of any length.
    ///
    /// The surface learns slowly. At the usual rate the score of the CPU itself moves by up to 0.2 dB where the index begins 1e-5
    /// higher or lower, and by 0.05 dB at this one.
    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn a_run_of_bent_rays_is_as_good_as_on_the_cpu() {
        glass_ball_is_as_good_as_on_the_cpu(&["--reflection", "off"]);
    }

    /// The same with caches that are baked, and learn what the glass mirrors.
    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn a_run_that_mirrors_is_as_good_as_on_the_cpu() {
        glass_ball_is_as_good_as_on_the_cpu(&["--reflection", "on"]);
    }

    fn glass_ball_is_as_good_as_on_the_cpu(more: &[&str]) {
        // Runs that round otherwise part company, and meet again within this; bent rays gain three times as much inside [dB].
        const TOL: f64 = 0.1;
        const GAIN: f64 = 1.0;
        let folder = tempfile::tempdir().unwrap();
        let data = refractive(folder.path(), "glass_ball", 24, 64);
        let settings = [
            "run.steps=250",
            "run.batch=1024",
            "grid.resolution=40",
            "field.sh_degree=2",
            "surface.rate=0.01",
        ];
        let guess = ["search.enabled=off", "search.guess=1.5", "judge.enabled=off"];
        let set = settings.iter().chain(&guess).flat_map(|s| ["--set", s]);
        let usual: Vec<&str> = set.chain(["--json"]).collect();
        let scores = |name: &str, words: &[&str]| {
            train(&data, &folder.path().join(name), &[&usual[..], words].concat()).done().json()
        };
        let inside = |scores: &Value| scores["psnr_inside"].as_f64().unwrap();
        let bent = |name: &str, device: &str| {
            let scores = scores(name, &[more, &["--refraction", "on", "--device", device]].concat());
            assert_eq!(scores["run"]["device"]["name"] == "cpu", device == "cpu");
            scores
        };
        let straight = inside(&scores("straight", &["--refraction", "off", "--device", "cpu"]));
        let (cpu, gpu) = (bent("cpu", "cpu"), bent("gpu", "gpu:0"));
        let gain = inside(&cpu) - straight;
        assert!(gain > GAIN, "straight {straight:.3} dB inside, bent {gain:.3} more");
        let (cpu, gpu) = (psnr(&cpu), psnr(&gpu));
        assert!((cpu - gpu).abs() < TOL, "{cpu:.3} dB on the CPU, {gpu:.3} dB on the GPU");
    }

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn what_a_gpu_cannot_do_is_refused_before_the_work() {
        let (_folder, data, run) = ball_and("run");
        let euler = ["--refraction", "on", "--set", "index.integrator=euler", "--device", "gpu:0"];
        train(&data, &run, &euler).refused(6, &["by leapfrog only", "--device cpu"]);
        assert!(!run.exists());
    }

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn a_gpu_without_room_gives_way_to_the_cpu_unless_it_was_asked_for() {
        let gpu = Gpu::open(DeviceChoice::Adapter(0)).unwrap().unwrap().with_memory(1000);
        let made = |choice| {
            let device = Device { name: "a GPU".to_owned(), why: None };
            let mut decided = Decided { opened: Opened::Gpu(gpu.clone()), device };
            let made = decided.backend(choice, model(BenchGrid::Dense(8)), None, Show::Nothing);
            (made.map(|backend| backend.may_fail()).map_err(|e| e.to_string()), decided.device)
        };
        let (found, device) = made(DeviceChoice::Auto);
        assert_eq!((found, device.name.as_str()), (Ok(false), "cpu"));
        assert!(device.why.is_some_and(|why| why.contains("has 1000")));
        let refused = made(DeviceChoice::Gpu).0.unwrap_err();
        assert!(refused.contains("has 1000") && refused.contains("--device cpu"), "{refused}");
    }

    /// llvmpipe counts the steps of a ray: with this length of a step the coarse grid stays below its limit, the fine one
    /// does not.
    #[test]
    #[ignore = "needs a software adapter as the first one: hardware counts no steps"]
    fn a_software_adapter_that_fails_leaves_a_run_that_goes_on_on_the_cpu() {
        assert_eq!(adapters()[0]["kind"], "software");
        let (_folder, data, run) = ball_and("run");
        let fine = ["--set", "grid.resolution=56", "--set", "march.step=0.05", "--set", "grid.stages=2"];
        let failed = straight(&data, &run, &[&fine[..], &["--device", "gpu:0"]].concat());
        let failed = failed.refused(
            6,
            &["stops loops after 65535", "is saved as it was at step", "--resume", "--device cpu"],
        );
        assert!(!failed.err.contains("at step 0"), "{}", failed.err);
        straight(&data, &run, &[&fine[..], &["--resume", "--device", "cpu"]].concat()).done();
        assert!(log(&run).contains("device_chosen"));
    }

    /// A run on a glass ball that mirrors, whose index and shape were given.
    fn glass_run(folder: &Path) -> PathBuf {
        let (data, run) = (ball(folder), folder.join("run"));
        train_with_index(&data, &run, &data.join("scene.json"), &["--device", "cpu"]);
        run
    }

    /// Names of the pictures that lie in a folder itself.
    fn pictures(folder: &Path) -> Vec<String> {
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
        files.map(|name| name.into_string().unwrap()).filter(|name| name.ends_with(".png")).collect()
    }

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn views_are_rendered_as_on_the_cpu() {
        // Mean of all code values: both round, and rays that graze the ball take another path.
        const TOL: f64 = 0.3;
        let folder = tempfile::tempdir().unwrap();
        let run = glass_run(folder.path());
        let rendered = |device: &str| {
            let out = folder.path().join(device.replace(':', ""));
            let layers = ["--outputs", "colour,reflection,transmission,opacity", "--set-index", "1.4"];
            let views = ["render", path(&run), "--out", path(&out), "--orbit", "2", "--size", "40x40"];
            let ran = refraxel(&[&views[..], &layers[..], &["--device", device]].concat()).done();
            assert_eq!(ran.err.contains("note: on "), device != "cpu", "{}", ran.err);
            out
        };
        let (cpu, gpu) = (rendered("cpu"), rendered("gpu:0"));
        let layers = ["", "reflection/", "transmission/", "opacity/"];
        let names: Vec<String> =
            pictures(&cpu).iter().flat_map(|name| layers.map(|of| format!("{of}{name}"))).collect();
        assert_eq!(names.len(), 8, "{names:?}");
        for name in names {
            let [a, b] = [&cpu, &gpu].map(|out| stored_pixels(out.join(&name)).unwrap().to_rgb8().into_raw());
            let apart: u64 = a.iter().zip(&b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
            let mean = apart as f64 / a.len() as f64;
            assert!(mean < TOL && a.iter().any(|v| *v != a[0]), "{name}: {mean}");
        }
    }

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn a_split_is_scored_as_by_the_cpu() {
        // Both round [dB].
        const TOL: f64 = 0.01;
        let folder = tempfile::tempdir().unwrap();
        let run = glass_run(folder.path());
        let [cpu, gpu] = ["cpu", "gpu:0"].map(|device| {
            let scores = refraxel(&["eval", path(&run), "--device", device, "--json"]).done().json();
            assert_eq!(scores["run"]["device"]["name"], "cpu");
            assert_eq!(scores["run"]["rendered_by"]["name"] == "cpu", device == "cpu", "{scores}");
            psnr(&scores)
        });
        assert!((cpu - gpu).abs() < TOL, "{cpu:.4} dB by the CPU, {gpu:.4} dB by the GPU");
    }

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn a_page_is_painted_as_by_the_cpu() {
        const TOL: f32 = 2e-3;
        let folder = tempfile::tempdir().unwrap();
        let run = glass_run(folder.path());
        let scene = |device| {
            let scene = Scene::new("ball".to_owned(), Run::load(&run).unwrap(), None);
            scene.on(device, Show::Nothing).map_err(|failure| failure.error).unwrap()
        };
        let (mut cpu, mut gpu) = (scene(DeviceChoice::Cpu), scene(DeviceChoice::Adapter(0)));
        let ray = |k: u32| {
            let to = vec3(0.02 * (k % 20) as f32 - 0.2, 0.0, 0.02 * (k / 20) as f32 - 0.35);
            let from = vec3(0.3, -3.0, 1.0);
            Ray { origin: from, direction: (to - from).normalized() }
        };
        let rays: Vec<Ray<f32>> = (0..400).map(ray).collect();
        let camera = cpu.describe().start;
        let mut seen = Vec::new();
        for look in [
            json!({ "id": 0, "camera": camera }),
            json!({ "id": 1, "camera": camera, "edits": { "index": [1.33] } }),
            json!({ "id": 2, "camera": camera, "straight": true }),
            json!({ "id": 3, "camera": camera }),
        ] {
            let look: Look = serde_json::from_value(look).unwrap();
            cpu.wear(&look).unwrap();
            gpu.wear(&look).unwrap();
            let (want, found) = (cpu.render(&rays, Layers::All), gpu.render(&rays, Layers::All));
            let apart = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).sum::<f32>();
            let all: f32 = want.iter().zip(&found).map(|(a, b)| apart((&a.colour, &b.colour))).sum();
            let mean = all / (3 * rays.len()) as f32;
            assert!(mean < TOL, "look {}: {mean}", look.id);
            seen.push(found);
        }
        assert!(
            seen[0] == seen[3] && seen[0] != seen[1] && seen[1] != seen[2],
            "every look shows its own medium"
        );
        assert_eq!(gpu.backend().medium().medium.regions().len(), 1);
    }

    #[test]
    #[ignore = "needs a software adapter as the first one: hardware counts no steps"]
    fn where_a_software_adapter_fails_the_cpu_renders() {
        assert_eq!(adapters()[0]["kind"], "software");
        let (folder, data, run) = ball_and("run");
        // More steps in a ray than llvmpipe takes: 140 nodes, twenty steps each, 14 iterations a step.
        let fine =
            ["grid.resolution=140", "march.render_step=0.05", "field.sh_degree=3"].map(|o| ["--set", o]);
        straight(&data, &run, &[fine.as_flattened(), &["--device", "cpu"]].concat()).done();
        let [cpu, gpu] = ["cpu", "gpu:0"].map(|device| {
            let out = folder.path().join(device.replace(':', ""));
            let views = ["render", path(&run), "--out", path(&out), "--orbit", "2", "--size", "8x8"];
            let ran = refraxel(&[&views[..], &["--device", device]].concat()).done();
            let told = ran.err.matches("on the CPU from here on, since the GPU failed").count();
            assert_eq!(told, usize::from(device != "cpu"), "{}", ran.err);
            assert_eq!(ran.err.contains("65535"), device != "cpu", "{}", ran.err);
            let mut names = pictures(&out);
            names.sort();
            names.iter().map(|name| std::fs::read(out.join(name)).unwrap()).collect::<Vec<_>>()
        });
        assert!(cpu == gpu && cpu.len() == 2, "the same pictures");
    }

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn a_gpu_is_measured() {
        let found = refraxel(&["bench", "--quick", "--device", "gpu:0", "--json"]).done().json();
        for rays in ["straight", "sharp"] {
            for key in ["forward_msamples_per_s", "train_msamples_per_s", "train_rays_per_s"] {
                assert!(found[rays][key].as_f64().unwrap() > 0.0, "{found}");
            }
        }
        assert!(found["copy_gb_per_s"].as_f64().unwrap() > 0.0);
        assert_eq!((&found["device"]["number"], &found["grid"]["dense"]), (&json!(0), &json!(128)));
        let kernels = found["straight"]["kernels"].as_array().unwrap();
        if !found["straight"]["busy"].is_null() {
            let learn = kernels.iter().find(|k| k["kernel"] == "learn").unwrap();
            assert!(learn["gb_per_s"].as_f64().unwrap() > 0.0, "{learn}");
        }
    }

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn a_grid_that_no_gpu_can_hold_is_not_measured() {
        let large = ["bench", "--quick", "--device", "gpu:0", "--grid", "1024"];
        refraxel(&large).refused(6, &["byte", "--device cpu"]);
        refraxel(&["bench", "--grid", "round"]).refused(2, &["round", "or sparse"]);
    }
}
