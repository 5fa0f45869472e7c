//! The command line as types; `values.rs` parses the strings.

mod audits;
mod stages;

use std::ffi::OsString;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

pub use audits::{
    AuditAgainArgs, AuditArgs, AuditImagesArgs, AuditMapArgs, AuditReleasedArgs, AuditSequenceArgs,
    MapArgs, OracleArgs, PaintArgs, SolverArgs, public_name,
};
pub use stages::{
    CompareArgs, DemoArgs, EvaluateArgs, ExportArgs, FeaturesArgs, InvertArgs, NeighborsArgs,
    ObfuscateArgs, RecoverArgs, TableArgs,
};

/// Measure how much of a privacy-preserving ("obfuscated") map or image an attacker recovers
#[derive(Debug, Parser)]
#[command(
    name = "unlift",
    version = env!("UNLIFT_VERSION"),
    term_width = 100,
    after_help = include_str!("help/unlift.txt").trim_end()
)]
pub struct Cli {
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

impl Cli {
    /// Returns the definition of all commands and options.
    pub fn definition() -> clap::Command {
        grouped(numbers_may_be_negative(Self::command()))
    }

    /// Reads a command line, whose first word is the name of the program.
    pub fn read(
        line: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    ) -> Result<Self, clap::Error> {
        let matches = Self::definition().try_get_matches_from(line)?;
        Self::from_arg_matches(&matches)
    }
}

/// Accepts negative numbers as values, so that the error of `--scale -1` is about the value -1, not about an option `-1`.
fn numbers_may_be_negative(command: clap::Command) -> clap::Command {
    let forgiving = |arg: clap::Arg| match arg.get_action().takes_values() && !arg.is_positional() {
        true => arg.allow_negative_numbers(true),
        false => arg,
    };
    command.mut_args(forgiving).mut_subcommands(numbers_may_be_negative)
}

/// The commands under each heading of `unlift --help`.
const GROUPS: [(&str, &str); 3] = [
    ("Audits", "demo audit compare table"),
    ("Stages", "obfuscate neighbors recover evaluate export features invert"),
    ("Tools", "schemes models help"),
];

/// Lists the commands under the headings of `GROUPS`, because clap has one heading for all commands.
fn grouped(command: clap::Command) -> clap::Command {
    // `build` adds the command `help`.
    let mut built = command.clone();
    built.build();
    let (header, literal) = (built.get_styles().get_header(), built.get_styles().get_literal());
    let mut lists = String::new();
    for (heading, names) in GROUPS {
        lists += &format!("{header}{heading}:{header:#}\n");
        for name in names.split(' ') {
            let about = built.find_subcommand(name).and_then(clap::Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            lists += &format!("  {literal}{name}{literal:#}{:1$}{about}\n", "", 13 - name.len());
        }
        lists.push('\n');
    }
    command.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n\
         {lists}{header}Options:{header:#}\n{{options}}{{after-help}}"
    ))
}

/// The command.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Protect two photos and a map, attack them, and show what the attacks recover
    Demo(DemoArgs),
    /// Audit a map, images or your own scheme: measure how much an attack recovers
    #[command(subcommand)]
    Audit(AuditCommand),
    /// Compare two audits, and fail if the later one leaks more
    Compare(CompareArgs),
    /// Print the results of an audit as a table for a paper or another program
    Table(TableArgs),
    /// Hide the points of a map, or the keypoints of images, with one scheme
    Obfuscate(ObfuscateArgs),
    /// Make lists of neighbors of the hidden points from released data, or from the truth
    Neighbors(NeighborsArgs),
    /// Recover hidden points from a released file and lists of neighbors
    Recover(RecoverArgs),
    /// Compare recovered points with the original points
    Evaluate(EvaluateArgs),
    /// Convert released, recovered or original points to PLY or COLMAP
    Export(ExportArgs),
    /// Write keypoints and descriptors of photos (or a COLMAP database) in hloc's format
    Features(FeaturesArgs),
    /// Paint pictures from descriptors and the positions of keypoints or recovered points
    Invert(InvertArgs),
    /// List the schemes: how they hide points, what stays hidden, publication, patents
    Schemes,
    /// List the networks: purpose, license, hash, owner, and whether they are installed
    #[command(after_help = include_str!("help/models.txt").trim_end())]
    Models,
}

/// Kinds of audits.
#[derive(Debug, Subcommand)]
#[command(after_help = include_str!("help/audit.txt").trim_end())]
pub enum AuditCommand {
    /// Audit a 3D map: hide its points, attack the result, and report how many are recovered
    // Boxed, because it is ten times larger than the other commands.
    Map(Box<AuditMapArgs>),
    /// Audit images: hide their keypoints, attack the result, and report how many are recovered
    Images(Box<AuditImagesArgs>),
    /// Audit a scheme of your own: attack its records, and report how many points are recovered
    Released(Box<AuditReleasedArgs>),
    /// Audit several images with known poses: report how many keypoints they give away together
    Sequence(Box<AuditSequenceArgs>),
    /// Audit a map that is released twice: report how many points both releases give away together
    Again(Box<AuditAgainArgs>),
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;

    /// The command line stays small enough to be read.
    #[test]
    fn commands_and_options_are_few_and_every_command_is_in_one_group() {
        let mut command = Cli::command();
        command.build();
        let known = command.get_subcommands().map(clap::Command::get_name);
        assert!(known.eq(GROUPS.iter().flat_map(|(_, names)| names.split(' '))));
        let audits = command.find_subcommand("audit").expect("audits").get_subcommands();
        let commands = command.get_subcommands().chain(audits);
        let is_leaf = |command: &&clap::Command| !["audit", "help"].contains(&command.get_name());
        let leaves: Vec<&clap::Command> = commands.filter(is_leaf).collect();
        let options = leaves.iter().flat_map(|command| command.get_arguments());
        let options: BTreeSet<&str> = options.filter_map(clap::Arg::get_long).collect();
        assert!(leaves.len() <= 17 && options.len() <= 45, "{} {options:?}", leaves.len());
    }

    /// The command lines of `docs/examples` parse, and build the version that builds this crate.
    #[test]
    fn examples_are_command_lines() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/examples");
        for name in ["github-action.yml", "gitlab-ci.yml", "Dockerfile"] {
            let text = std::fs::read_to_string(folder.join(name)).expect(name);
            let image = format!("rust:{}-", env!("CARGO_PKG_RUST_VERSION"));
            assert_eq!(text.contains("rust:"), text.contains(&image), "{name}");
            let lines = text.lines().filter_map(|line| line.split_once("unlift audit "));
            let lines: Vec<&str> = lines.map(|(_, line)| line).collect();
            assert_eq!(lines.len(), 1, "{name}");
            let words = lines[0].split(' ').map(|word| word.trim_matches('\''));
            let read = Cli::read(["unlift", "audit"].into_iter().chain(words));
            read.unwrap_or_else(|error| panic!("{name}: {error}"));
        }
    }
}
