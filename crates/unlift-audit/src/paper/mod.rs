//! The paper's tables on its own datasets: ours beside the published numbers.
//!
//! ```text
//! layouts::open ──> Scene .. ──> audits (maps, images) ──> Compared .. ──> sheets, paper.json, paper.csv
//! ```
//!
//! Nothing is measured here: every scene goes through [`crate::maps`] and [`crate::images::audit`] as any other map or
//! folder of photos would, and what is compared are the rows of their documents.

mod audits;
mod compared;
mod layouts;
mod missing;
mod request;
mod result;
mod scale;

use unlift_io::atomic::{Access, Kind, OutputSet};

pub use compared::Compared;
pub use layouts::{Dataset, Poses, Scene};
pub use request::{Part, Request};
pub use result::{FIGURES, Reproduction, Sheet, TABLE};

use crate::{Error, refused};

/// Audits every scene that is there and holds what comes back against the paper's tables. Scenes that cannot be audited are
/// told and counted; the others go on. Without a single audit nothing is written.
///
/// # Errors
/// When there is no scene, a list of the dataset is malformed, the folder cannot be written, or `begin`'s progress says
/// stop.
pub fn reproduce(request: &Request<'_>) -> Result<Reproduction, Error> {
    let mut scenes = layouts::open(request.dataset, request.root, request.models)?;
    chosen(request, &mut scenes)?;
    let first = [(FIGURES, Kind::AuditJson), (TABLE, Kind::Table)];
    let out = OutputSet::create(request.out, request.rules(), Access::Usual, &first);
    let out = out.map_err(refused)?;
    let mut run = audits::Run::new(request);
    for scene in &scenes {
        run.audit(scene)?;
    }
    let result = Reproduction::new(request, &scenes, run);
    if !result.pages.is_empty() {
        result.write(out)?;
    }
    Ok(result)
}

/// Keeps the scenes that were asked for.
fn chosen(request: &Request<'_>, scenes: &mut Vec<Scene>) -> Result<(), Error> {
    for name in &request.scenes {
        let known = request.dataset.scenes();
        if !known.contains(&name.as_str()) {
            let known = known.join(", ");
            return Err(Error::request(format!(
                "--scenes: expected some of {known}, found {name}"
            )));
        }
        if !scenes.iter().any(|scene| scene.name == *name) {
            let there: Vec<&str> = scenes.iter().map(|scene| scene.name.as_str()).collect();
            let (root, there) = (request.root, there.join(", "));
            return Err(unlift_io::Error::new(root, "", format!("a folder {name}"), there).into());
        }
    }
    if !request.scenes.is_empty() {
        scenes.retain(|scene| request.scenes.contains(&scene.name));
    }
    Ok(())
}
