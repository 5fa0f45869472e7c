//! Arguments of `unlift check`.

use std::path::PathBuf;

use clap::Args;

/// Options of `check`.
#[derive(Debug, Args)]
#[command(after_help = "\
A configuration has a table per audit, [[map]], [[images]] or [[released]], with a path and any long
options of unlift audit map, images or released (but --json); lists are arrays or text with commas.
Paths are relative to the configuration.

  [[map]]
  path = \"maps/office\"
  scale = 1
  schemes = [\"ppl\", \"ppl+\"]
  gate = [\"all@0.5:0.10<=20\"]
  out = \"audits/office\"
  junit = \"audits/office.xml\"
  share-safe = true

Every audit is run, whatever becomes of the others, and told in one line.

Examples:
  unlift check
  unlift check ci/unlift.toml --quiet

Exit codes: 0 done, 1 a gate failed, 2 usage, be it in the configuration, 3 bad input; of several
audits the largest.")]
pub struct CheckArgs {
    /// A configuration
    #[arg(value_name = "CONFIG", default_value = "unlift.toml")]
    pub config: PathBuf,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}
