//! A library of candidates beside what came of weighing it last.

use std::sync::{Mutex, PoisonError};

use crate::data::Trial;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::candidates::Library;
use crate::hypothesis::stream::normals;
use crate::weigh::chance::{Weighed, Weighing};
use crate::weigh::criterion::Penalty;
use crate::weigh::regression::{Beside, Level, pairs, rank, spread};

/// Which candidates a step chooses from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    Catalogue,
    Terms,
}

/// Candidates along a fit of the training data.
pub(crate) struct Signatures {
    pub(crate) library: Library,
    /// The size of what is random at which they were weighed last, and what came of it.
    weighed: Mutex<Option<(Randomness, Weighed)>>,
    /// The sizes at which the best of them were weighed last, the first that of all, and what came of it.
    best: Mutex<Option<(Vec<Randomness>, Vec<Level>)>>,
}

impl Signatures {
    pub(crate) fn new(library: Library) -> Self {
        Self { library, weighed: Mutex::default(), best: Mutex::default() }
    }

    /// What comes of weighing all of them along their fit.
    pub(crate) fn weighed(&self, fit: &Fit, trials: &[Trial], randomness: &Randomness) -> Weighed {
        let known = || self.weighed.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((size, weighed)) = &*known()
            && size.same(randomness)
        {
            return weighed.clone();
        }
        let weighed = Weighing { fit, trials, library: &self.library, randomness }.weigh();
        *known() = Some((randomness.clone(), weighed.clone()));
        weighed
    }
}

/// Columns kept for the smaller levels: those of the candidates that do best at the largest.
const KEPT: usize = 40;

/// Forms the normal equations at every size: all columns at the first, the best candidates' columns at the others. Steps of a round ask
/// for the same ones.
pub(crate) fn levels(fit: &Fit, trials: &[Trial], signatures: &Signatures, sizes: &[Randomness]) -> Vec<Level> {
    let known = || signatures.best.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((those, levels)) = &*known()
        && those.len() == sizes.len()
        && those.iter().zip(sizes).all(|(known, size)| known.same(size))
    {
        return levels.clone();
    }
    let library = &signatures.library;
    let mut out = vec![signatures.weighed(fit, trials, &sizes[0]).level];
    if sizes.len() > 1 {
        let best = rank(library, &out, Penalty::NONE);
        let mut columns: Vec<usize> =
            best.iter().take(KEPT).flat_map(|s| library.candidates[s.candidate].columns.clone()).collect();
        columns.extend(library.beside.iter().map(|(column, _)| *column));
        columns.sort_unstable();
        columns.dedup();
        let kept = library.of_columns(&columns);
        let pairs = pairs(library, &columns);
        let smaller = normals(fit, trials, (&kept.variations, &kept.columns), &sizes[1..], Some(&pairs));
        out.extend(smaller.iter().map(|small| {
            let mut normal = spread(small, &columns, library.columns.len());
            Beside::new(library, &normal).take_from(&mut normal);
            Level { normal }
        }));
        *known() = Some((sizes.to_vec(), out.clone()));
    }
    out
}
