//! Arguments of `unlift demo`.

use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use crate::values;

/// Options of `demo`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift demo
  unlift demo --out /tmp/demo

Protects two photos and the map of a made-up room by ten published schemes, attacks what a service
would receive, and shows what came back. It needs no data.")]
pub struct DemoArgs {
    /// Folder for report.html, photos.html and their figures; whatever else is in it stays
    #[arg(long, value_name = "DIR", default_value = "unlift-demo")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Threads to use [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}
