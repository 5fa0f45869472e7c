//! Commands about the program: schemes, models, doctor, completions, man.

use clap_complete::generate;
use clap_mangen::Man;
use serde_json::json;
use unlift::OneLine;
use unlift::obfuscate::{ON_REQUEST, all};
use unlift::simd::instructions;
use unlift_audit::total_bytes;
use unlift_vision::network::{Entry, Folders, MODELS, Place};

use crate::args::{Cli, CompletionsArgs, DoctorArgs, ManArgs, ModelsArgs};
use crate::exit::{Outcome, usage};
use crate::output::print;

pub fn schemes() -> anyhow::Result<Outcome> {
    let mut text = String::new();
    for scheme in all() {
        let meant_for = match (scheme.in_3d, scheme.in_2d) {
            (Some(_), Some(_)) => "maps and images",
            (Some(_), None) => "maps",
            (None, _) => "images",
        };
        let request = if ON_REQUEST.iter().any(|entry| entry.name == scheme.name) {
            ", on request"
        } else {
            ""
        };
        let facts = scheme.facts;
        text.push_str(&format!(
            "{}\n  for          {meant_for}{request}\n  rule         {}\n  hidden       {}\n  publication  {}\n  patents      {}\n",
            scheme.name, facts.summary, facts.hidden, facts.source, facts.patents
        ));
    }
    print(&text)?;
    Ok(Outcome::Done)
}

pub fn models(args: &ModelsArgs) -> anyhow::Result<Outcome> {
    let folders = Folders::of_process();
    let mut text = String::new();
    let mut rows = Vec::with_capacity(MODELS.len());
    for entry in MODELS {
        let place = folders.find(entry)?;
        let here = here(place.as_ref(), &folders, entry);
        let hash = entry.sha256.unwrap_or("not known: its bytes depend on what it was made with");
        text.push_str(&format!(
            "{}\n  for      {}\n  licence  {}\n  owner    {}\n  sha256   {hash}\n  here     {here}\n",
            entry.name, entry.purpose, entry.licence, entry.owner
        ));
        rows.push(json!({
            "name": entry.name,
            "for": entry.purpose,
            "licence": entry.licence,
            "owner": entry.owner,
            "sha256": entry.sha256,
            "carried": entry.carried.is_some(),
            "here": place.is_some(),
            "file": match &place {
                Some(Place::File(path)) => Some(path.display().to_string()),
                Some(Place::Carried) | None => None,
            },
        }));
    }
    print(&if args.json { serde_json::to_string_pretty(&rows)? + "\n" } else { text })?;
    Ok(Outcome::Done)
}

fn here(place: Option<&Place>, folders: &Folders, entry: &Entry) -> String {
    match place {
        Some(Place::Carried) => "in the program".to_owned(),
        Some(Place::File(path)) => OneLine(path.display()).to_string(),
        None => format!("no: {}", OneLine(folders.missing(entry))),
    }
}

const BROWSERS: [&str; 6] =
    ["firefox", "chromium", "chromium-browser", "google-chrome", "microsoft-edge", "xdg-open"];

/// Prints version, CPU features, threads, memory, models and a browser.
pub fn doctor(args: &DoctorArgs) -> anyhow::Result<Outcome> {
    let folders = Folders::of_process();
    let (mut here, mut missing) = (Vec::new(), Vec::new());
    for entry in MODELS {
        let is_here = folders.find(entry)?.is_some();
        if is_here { &mut here } else { &mut missing }.push(entry.name);
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let memory = total_bytes();
    let browser = BROWSERS.into_iter().find(|name| is_on_path(name));
    let (system, machine) = (std::env::consts::OS, std::env::consts::ARCH);
    let build = if cfg!(debug_assertions) { "debug" } else { "release" };
    let version = env!("UNLIFT_VERSION");
    let text = if args.json {
        let object = json!({
            "version": version,
            "build": build,
            "system": system,
            "machine": machine,
            "instructions": instructions(),
            "threads": threads,
            "memory_bytes": memory,
            "models": here,
            "models_missing": missing,
            "browser": browser,
        });
        serde_json::to_string_pretty(&object)? + "\n"
    } else {
        let memory = memory.map_or_else(
            || "not known here".to_owned(),
            |bytes| format!("{:.1} GiB", bytes as f64 / f64::from(1 << 30)),
        );
        let absent = match missing.as_slice() {
            [] => String::new(),
            missing => {
                format!("; not here: {} (unlift models says where they belong)", missing.join(", "))
            }
        };
        let page = match browser {
            Some(name) => format!("{name} opens reports"),
            None => {
                "none found on the path: open report.html by hand, it needs no network".to_owned()
            }
        };
        format!(
            "version       {version}, {build}, {system} on {machine}\n\
             instructions  {} (results are the same with any)\n\
             threads       {threads}\n\
             memory        {memory}\n\
             models        {}{absent}\n\
             browser       {page}\n",
            instructions(),
            here.join(", "),
        )
    };
    print(&text)?;
    Ok(Outcome::Done)
}

fn is_on_path(name: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(name).is_file())
}

const NAME: &str = "unlift";

pub fn completions(args: &CompletionsArgs) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    generate(args.shell, &mut Cli::definition(), NAME, &mut script);
    print(&String::from_utf8(script)?)?;
    Ok(Outcome::Done)
}

pub fn man(args: &ManArgs) -> anyhow::Result<Outcome> {
    let mut found = Cli::definition();
    // `build` adds the global options.
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
