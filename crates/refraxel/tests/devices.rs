//! Devices on the command line. What needs an adapter runs with the feature `gpu` on any machine that has one, be it a
//! software one: `cargo test -p refraxel --features gpu --test devices -- --ignored`.

mod common;

use common::{Ran, ball, refraxel, train};
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
    let folder = tempfile::tempdir().unwrap();
    let (data, run) = (ball(folder.path()), folder.path().join("run"));
    let scores = straight(&data, &run, &["--device", "cpu", "--json"]).done().json();
    assert_eq!(scores["run"]["device"]["name"], "cpu");
    assert!(log(&run).contains(r#""event":"device_chosen","device":{"name":"cpu"}"#));
}

#[cfg(not(feature = "gpu"))]
#[test]
fn without_gpus_the_program_says_how_to_get_them_before_it_works() {
    let folder = tempfile::tempdir().unwrap();
    let (data, run) = (ball(folder.path()), folder.path().join("run"));
    straight(&data, &run, &["--device", "gpu"]).refused(6, &["--features gpu", "--device cpu"]);
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
    use common::refractive;
    use serde_json::Value;

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
        let folder = tempfile::tempdir().unwrap();
        let (data, run) = (ball(folder.path()), folder.path().join("run"));
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
        // Runs that round otherwise part company, and meet again within this [dB].
        const TOL: f64 = 0.1;
        let folder = tempfile::tempdir().unwrap();
        let data = refractive(folder.path(), "glass_ball", 24, 64);
        let mut words = vec!["--refraction", "on", "--json"];
        words.extend(more);
        for setting in [
            "run.steps=250",
            "run.batch=1024",
            "grid.resolution=40",
            "surface.rate=0.01",
            "search.enabled=off",
            "search.guess=1.5",
            "judge.enabled=off",
        ] {
            words.extend(["--set", setting]);
        }
        let [cpu, gpu] = ["cpu", "gpu:0"].map(|device| {
            let words = [&words[..], &["--device", device]].concat();
            let scores = train(&data, &folder.path().join(device.replace(':', "")), &words).done().json();
            assert_eq!(scores["run"]["device"]["name"] == "cpu", device == "cpu");
            psnr(&scores)
        });
        assert!(cpu > 22.0 && (cpu - gpu).abs() < TOL, "{cpu:.3} dB on the CPU, {gpu:.3} dB on the GPU");
    }

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn what_a_gpu_cannot_do_is_refused_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        let (data, run) = (ball(folder.path()), folder.path().join("run"));
        let euler = ["--refraction", "on", "--set", "index.integrator=euler", "--device", "gpu:0"];
        train(&data, &run, &euler).refused(6, &["by leapfrog only", "--device cpu"]);
        assert!(!run.exists());
    }

    /// llvmpipe counts the steps of a ray: with this length of a step the coarse grid stays below its limit, the fine one
    /// does not.
    #[test]
    #[ignore = "needs a software adapter as the first one: hardware counts no steps"]
    fn a_software_adapter_that_fails_leaves_a_run_that_goes_on_on_the_cpu() {
        assert_eq!(adapters()[0]["kind"], "software");
        let folder = tempfile::tempdir().unwrap();
        let (data, run) = (ball(folder.path()), folder.path().join("run"));
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

    #[test]
    #[ignore = "needs a Vulkan adapter"]
    fn a_gpu_is_measured() {
        let found = refraxel(&["bench", "--quick", "--device", "gpu:0", "--json"]).done().json();
        for key in ["forward_msamples_per_s", "train_msamples_per_s", "train_rays_per_s"] {
            assert!(found["straight"][key].as_f64().unwrap() > 0.0, "{found}");
        }
        assert_eq!(found["device"]["number"], 0);
    }
}
