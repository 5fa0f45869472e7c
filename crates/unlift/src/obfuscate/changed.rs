//! What a scheme may change beside the records: the map before it is hidden, or the descriptors.

use std::sync::Arc;

use super::mitigate::Mitigation;
use super::protect::Protection;
use super::scheme::{Lifted, LocalPoints, Scheme};
use crate::seed::Key;
use crate::truth::{DropReason, Dropped};
use crate::{Error, OriginalId};

/// A change of what a scheme releases.
#[derive(Clone, Debug)]
pub enum Change {
    /// Changes of the map before it is hidden, and the number of images per point, if known.
    Mitigation(Mitigation, Option<Arc<[u32]>>),
    /// Protected descriptors in place of plain ones.
    Protection(Protection),
}

impl Change {
    /// Returns true if it changes descriptors, so that fewer keypoints find their points.
    pub fn changes_descriptors(&self) -> bool {
        match self {
            Self::Mitigation(mitigation, _) => mitigation.changes_descriptors(),
            Self::Protection(_) => true,
        }
    }

    /// Returns the protection under which descriptors are released, if it is one.
    pub fn protection(&self) -> Option<&Protection> {
        match self {
            Self::Mitigation(..) => None,
            Self::Protection(protection) => Some(protection),
        }
    }
}

/// A scheme with a change. It is itself a scheme, so audits, gates and reports need nothing more.
#[derive(Clone, Debug)]
pub struct Changed<const D: usize> {
    scheme: Arc<dyn Scheme<D>>,
    change: Change,
    name: String,
}

impl<const D: usize> Changed<D> {
    /// Creates the scheme. Its name is the scheme's, followed by that of the change.
    pub fn new(scheme: Arc<dyn Scheme<D>>, change: Change) -> Self {
        let of_change = match &change {
            Change::Mitigation(mitigation, _) => mitigation.name(),
            Change::Protection(protection) => protection.name(),
        };
        Self { name: format!("{}_{of_change}", scheme.name()), scheme, change }
    }

    /// Returns every scheme under every change.
    pub fn all(schemes: &[Arc<dyn Scheme<D>>], changes: &[Change]) -> Vec<Arc<dyn Scheme<D>>> {
        let with = |change: &Change| {
            let of = |scheme: &Arc<_>| Self::new(Arc::clone(scheme), change.clone());
            schemes.iter().map(|scheme| Arc::new(of(scheme)) as Arc<_>).collect::<Vec<_>>()
        };
        changes.iter().flat_map(with).collect()
    }
}

impl<const D: usize> Scheme<D> for Changed<D> {
    fn name(&self) -> &str {
        &self.name
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        self.scheme.parameters()
    }

    fn lift(&self, points: &LocalPoints<'_, D>, key: &Key) -> Result<Lifted<D>, Error> {
        let Change::Mitigation(mitigation, tracks) = &self.change else {
            return self.scheme.lift(points, key);
        };
        let n = points.positions.len();
        let kept = mitigation.kept(n, tracks.as_deref(), key)?;
        let thinned: Vec<_> = kept.iter().map(|&row| points.positions[row as usize]).collect();
        let mut lifted = self.scheme.lift(&LocalPoints { positions: &thinned, ..*points }, key)?;
        let dropped = lifted.dropped.iter_mut().map(|dropped| &mut dropped.original);
        lifted.hidden.iter_mut().chain(dropped).for_each(|id| *id = OriginalId(kept[id.index()]));
        let out = (0..n as u32).filter(|row| kept.binary_search(row).is_err()).map(OriginalId);
        let out = out.map(|original| Dropped { original, reason: DropReason::Thinned });
        lifted.dropped.extend(out);
        Ok(lifted)
    }

    fn changes(&self) -> Vec<&Change> {
        [self.scheme.changes(), vec![&self.change]].concat()
    }
}
