//! The live viewer.

use std::path::PathBuf;

use clap::Args;

use super::renderer::RendererArgs;

/// `refraxel view`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel view                          the start page: choose photographs, train, look at the scene
  refraxel view run
  refraxel view run --port 8080 --threads 1

The program prints an address; open it in a browser on this machine. The start page opens by itself, where there is a browser. The address is \
known to nobody else, changes with every start, and is served on loopback only. From another machine, start the viewer with --port 8080 and a RUN, forward the port by \
`ssh -L 9000:127.0.0.1:8080 HOST`, and open the address with 9000 in place of 8080.

Ctrl-C ends the viewer. The run itself is not changed. Trainings and other work that the start page has begun are stopped, too; trainings are saved.")]
pub struct ViewArgs {
    /// The run's folder; without it, a start page opens in the browser: recent runs, photographs of this machine, training
    #[arg(value_name = "RUN")]
    pub run: Option<PathBuf>,
    /// Port on 127.0.0.1 [default: any that is free]
    #[arg(long, value_name = "PORT", value_parser = clap::value_parser!(u16).range(1..))]
    pub port: Option<u16>,
    /// What renders.
    #[command(flatten)]
    pub renderer: RendererArgs,
    /// Threads to use, at most 1024 [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print the address as JSON on standard output, and nothing else there; no browser is opened
    #[arg(long)]
    pub json: bool,
}
