//! Commands about the program: schemes and models.

use unlift::OneLine;
use unlift::obfuscate::{ON_REQUEST, all};
use unlift_vision::network::{Folders, MODELS};

use crate::output::print;

pub fn schemes() -> crate::Result<()> {
    let mut text = String::new();
    for scheme in all() {
        let meant_for = if scheme.dimensions() == 3 { "maps" } else { "images" };
        let is_requested = ON_REQUEST.iter().any(|entry| entry.name == scheme.name);
        let request = if is_requested { ", on request" } else { "" };
        text.push_str(&format!(
            "{}: {}\n  for          {meant_for}{request}\n  rule         {}\n  hidden       {}\n  publication  {}\n  patents      {}\n",
            scheme.name, scheme.title, scheme.rule, scheme.hidden, scheme.source, scheme.patents
        ));
    }
    print(&text)
}

pub fn models() -> crate::Result<()> {
    let folders = Folders::of_process();
    let mut text = String::new();
    for entry in MODELS {
        let here = match folders.find(entry)? {
            Some(path) => OneLine(path.display()).to_string(),
            None if entry.carried.is_some() => "in the program".to_owned(),
            None => format!("no: {}", OneLine(folders.missing(entry))),
        };
        let hash = entry.sha256.unwrap_or("not known: its bytes depend on what it was made with");
        text.push_str(&format!(
            "{}\n  for      {}\n  licence  {}\n  owner    {}\n  sha256   {hash}\n  here     {here}\n",
            entry.name, entry.purpose, entry.licence, entry.owner
        ));
    }
    print(&text)
}
