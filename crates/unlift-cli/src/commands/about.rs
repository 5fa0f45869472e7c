//! Commands about the program: schemes and models.

use serde_json::json;
use unlift::OneLine;
use unlift::obfuscate::{ON_REQUEST, all};
use unlift_vision::network::{Entry, Folders, MODELS, Place};

use crate::args::ModelsArgs;
use crate::exit::Outcome;
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
