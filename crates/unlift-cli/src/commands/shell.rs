//! `unlift completions` and `unlift man`: what shells and manuals know of the command line, made from its definition.

use clap_complete::generate;
use clap_mangen::Man;

use crate::args::{Cli, CompletionsArgs, ManArgs};
use crate::exit::{Outcome, usage};
use crate::output::print;

/// The name of the program.
const NAME: &str = "unlift";

/// Prints a script for a shell.
pub fn completions(args: &CompletionsArgs) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    generate(args.shell, &mut Cli::definition(), NAME, &mut script);
    print(&String::from_utf8(script)?)?;
    Ok(Outcome::Done)
}

/// Prints a page of the manual.
pub fn man(args: &ManArgs) -> anyhow::Result<Outcome> {
    let mut found = Cli::definition();
    // With what all commands have in common, as their help shows it.
    found.build();
    let mut name = NAME.to_owned();
    for word in &args.command {
        let Some(next) = found.find_subcommand(word) else {
            let names = found.get_subcommands().map(clap::Command::get_name);
            let names: Vec<&str> = names.filter(|name| *name != "help").collect();
            return Err(match names.as_slice() {
                [] => usage(format!("{name}: expected no further command, found {word}")),
                names => {
                    usage(format!("{name}: expected one of {}, found {word}", names.join(", ")))
                }
            });
        };
        name = format!("{name} {word}");
        found = next.clone();
    }
    let mut page = Vec::new();
    Man::new(found).render(&mut page)?;
    print(&String::from_utf8(page)?)?;
    Ok(Outcome::Done)
}
