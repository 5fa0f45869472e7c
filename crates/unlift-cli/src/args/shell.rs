//! Arguments of `unlift completions` and `unlift man`.

use clap::Args;
use clap_complete::Shell;

/// Options of `completions`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift completions bash > ~/.local/share/bash-completion/completions/unlift
  unlift completions zsh > ~/.zfunc/_unlift
  unlift completions fish > ~/.config/fish/completions/unlift.fish")]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL", value_enum)]
    pub shell: Shell,
}

/// Options of `man`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift man | man -l -
  unlift man audit map > unlift-audit-map.1")]
pub struct ManArgs {
    /// A command and its own commands, for example audit map
    #[arg(value_name = "COMMAND")]
    pub command: Vec<String>,
}
