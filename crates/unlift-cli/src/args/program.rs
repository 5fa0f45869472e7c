//! Arguments of commands about the program itself.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;

use crate::values;

/// Options of `demo`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift demo
  unlift demo --out /tmp/demo

unlift protects two photos and the map of a made-up room with ten published schemes, attacks what a
service would receive, and shows what is recovered. The demo needs no input.")]
pub struct DemoArgs {
    /// Folder for report.html, photos.html and their JSON files; other files in it stay
    #[arg(long, value_name = "DIR", default_value = "unlift-demo")]
    pub out: PathBuf,
    /// Replace files of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Number of threads [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Show no progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

/// Options of `models`.
#[derive(Debug, Args)]
#[command(after_help = "\
unlift looks for a network in the folder that the environment variable UNLIFT_MODELS names, then in
XDG_DATA_HOME/unlift/models (~/.local/share/unlift/models by default), then in the program itself.
It refuses a file whose hash differs from the listed one.")]
pub struct ModelsArgs {
    /// Print a JSON list in place of the text
    #[arg(long)]
    pub json: bool,
}
