//! Several processes that train one run. What needs MPI runs with the feature `mpi` where `mpirun` is installed:
//! `cargo test -p refraxel --features mpi --test processes -- --ignored`.

mod common;

#[cfg(not(feature = "mpi"))]
#[test]
fn without_mpi_the_program_says_how_to_get_it_before_it_works() {
    use common::{ball_and, refraxel, train};
    let (_folder, data, run) = ball_and("run");
    train(&data, &run, &["--device", "mpi"])
        .refused(6, &["--locked --path crates/refraxel --features mpi", "--device cpu"]);
    assert!(!run.exists());
    refraxel(&["bench", "--quick", "--device", "mpi"]).refused(6, &["share one training"]);
}

#[cfg(feature = "mpi")]
mod mpi {
    use super::common::{Ran, TINY, glass, path, train};
    use refraxel_train::checkpoint::{Tensor, TensorFile};
    use refraxel_train::run::CHECKPOINT;
    use std::collections::BTreeMap;
    use std::path::Path;
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant};

    const BENT: [&str; 4] = ["--refraction", "on", "--set", "batch=2048"];

    /// Training by so many processes of one thread each.
    fn mpirun(count: usize, data: &Path, run: &Path, more: &[&str]) -> Command {
        let mut command = Command::new("mpirun");
        command.args(["-n", &count.to_string(), env!("CARGO_BIN_EXE_refraxel"), "train", path(data)]);
        command.args(["--out", path(run), "--device", "mpi", "--threads", "1"]).args(TINY).args(more);
        // Open MPI refuses more processes than cores, and to work for root, unless it is told that this is meant; and processes that
        // wait keep a core busy unless they are told to leave it to others.
        for name in [
            "ALLOW_RUN_AS_ROOT",
            "ALLOW_RUN_AS_ROOT_CONFIRM",
            "MCA_rmaps_base_oversubscribe",
            "MCA_mpi_yield_when_idle",
        ] {
            command.env(format!("OMPI_{name}"), "1");
        }
        command
    }

    fn trained(count: usize, data: &Path, run: &Path, more: &[&str]) -> Ran {
        Ran::of(mpirun(count, data, run, more).output().expect("mpirun is installed"))
    }

    /// Starts a job, and waits until this file is there: long, where other work keeps all cores busy.
    fn started(job: &mut Command, file: &Path) -> Child {
        let start = Instant::now();
        let job = job.stderr(Stdio::null()).spawn().expect("mpirun is installed");
        while !file.is_file() {
            assert!(start.elapsed() < Duration::from_secs(300), "{}", file.display());
            std::thread::sleep(Duration::from_millis(50));
        }
        job
    }

    /// The processes of a job, the first one first.
    fn children(job: &Child) -> Vec<String> {
        let children = format!("/proc/{0}/task/{0}/children", job.id());
        let children = std::fs::read_to_string(children).expect("the processes of mpirun");
        children.split_whitespace().map(str::to_owned).collect()
    }

    fn learned(run: &Path) -> BTreeMap<String, Tensor<'static>> {
        TensorFile::load(&run.join(CHECKPOINT)).unwrap().tensors
    }

    #[test]
    #[ignore = "needs mpirun"]
    fn any_number_of_processes_learns_the_same_bits_as_one() {
        let folder = tempfile::tempdir().unwrap();
        let data = glass(folder.path());
        let alone = folder.path().join("alone");
        train(&data, &alone, &BENT).done();
        for count in [1, 2, 4] {
            let run = folder.path().join(count.to_string());
            let ran = trained(count, &data, &run, &BENT).done();
            assert!(learned(&run) == learned(&alone), "{count} processes");
            let told = format!("on the cpu of {count} processes");
            assert!(ran.err.contains(&told) && ran.err.contains("processes sent each other"), "{}", ran.err);
        }
    }

    /// Steps of the run that is saved.
    fn step(run: &Path) -> u64 {
        let header = TensorFile::load(&run.join(CHECKPOINT)).unwrap().header;
        header["state"]["step"].as_u64().unwrap_or_else(|| panic!("{header}"))
    }

    #[test]
    #[ignore = "needs mpirun"]
    fn a_wish_to_stop_that_mpirun_or_the_first_process_hears_saves_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let data = glass(folder.path());
        for signal in ["INT", "TERM"] {
            let run = folder.path().join(signal);
            let mut job = mpirun(2, &data, &run, &["--set", "steps=1000000"]);
            // Open MPI gives processes a second between its signal and their end, unless it is told otherwise.
            let mut job = started(job.env("OMPI_MCA_odls_base_sigkill_timeout", "8"), &run.join("log.jsonl"));
            assert!(!run.join(CHECKPOINT).exists(), "nothing was saved before");
            let whom = if signal == "INT" { job.id().to_string() } else { children(&job)[0].clone() };
            assert!(Command::new("kill").args([&format!("-{signal}"), &whom]).status().unwrap().success());
            assert!(!job.wait().unwrap().success());
            assert!(step(&run) > 0);
        }
    }

    #[test]
    #[ignore = "needs mpirun"]
    fn what_the_first_process_refuses_ends_all() {
        let folder = tempfile::tempdir().unwrap();
        let ran = trained(3, &folder.path().join("nowhere"), &folder.path().join("run"), &[]);
        assert!(ran.code == 3 && ran.err.contains("nowhere"), "{} {}", ran.code, ran.err);
    }

    #[test]
    #[ignore = "needs mpirun"]
    fn a_process_that_is_lost_ends_the_job_and_the_run_goes_on_from_its_last_save() {
        let folder = tempfile::tempdir().unwrap();
        let (data, run) = (glass(folder.path()), folder.path().join("run"));
        let endless = ["--set", "steps=1000000", "--set", "run.save_every=1"];
        let mut job = started(&mut mpirun(2, &data, &run, &endless), &run.join(CHECKPOINT));
        let (last, lost) = (children(&job).pop().expect("two processes"), Instant::now());
        assert!(Command::new("kill").args(["-9", &last]).status().unwrap().success());
        assert!(!job.wait().unwrap().success());
        assert!(lost.elapsed() < Duration::from_secs(60), "nobody waits for the one that is lost");
        let saved = step(&run);
        let until = format!("stop_after={}", saved + 5);
        train(&data, &run, &[&endless[..2], &["--set", &until, "--resume"]].concat())
            .refused(130, &["--resume continues"]);
        assert_eq!(step(&run), saved + 5);
    }
}
