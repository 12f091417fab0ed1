//! The candidates that a step chooses from, made for the fit that stands.

use std::sync::Arc;

use crate::filter::estimate::Fit;
use crate::hypothesis::beside::set_found_beside;
use crate::hypothesis::candidates::{Situation, catalogue, dictionary};
use crate::hypothesis::spectrum::{drum_waves, peaks, waves};
use crate::hypothesis::survey::set_beside;
use crate::strategy::context::Context;
use crate::strategy::fitted::Fitted;
use crate::strategy::standing::Standing;
use crate::weigh::signatures::{Signatures, Source};

/// The signatures of the catalogue, or of terms outside it, along a fit.
pub(crate) fn signatures(
    context: &Context<'_>,
    standing: &Standing,
    fitted: &Fitted,
    source: Source,
) -> Arc<Signatures> {
    if let Some((known, score, signatures)) = &standing.weighed
        && *known == source
        && *score == fitted.score
    {
        return Arc::clone(signatures);
    }
    let fit = &fitted.train;
    let mut library = match source {
        Source::Catalogue => {
            (context.progress)("weighing the catalogue", 0.1 + 0.12 * standing.accepted.len() as f64);
            catalogue(&fit.model, &situation(context, fit))
        }
        Source::Terms => dictionary(&situation(context, fit)),
    };
    set_beside(&mut library, &fit.model, context.free_from..context.given);
    // Whether a term goes with the held-out data is foreseen by its signature alone.
    if source == Source::Catalogue {
        set_found_beside(&mut library, &fit.model, context.given..fit.model.effects.len());
    }
    Arc::new(Signatures::new(library))
}

/// What the candidates need to know of the data, with the spectral peaks of the latent forces.
pub(crate) fn situation(context: &Context<'_>, fit: &Fit) -> Situation {
    let trials = &context.evidence.train;
    let mut situation = Situation::of(trials);
    let of_forces = || rayon::join(|| peaks(fit, trials), || waves(fit, trials));
    let ((peaks, waves), (each, all)) = rayon::join(of_forces, || drum_waves(fit, trials));
    (situation.peaks, situation.waves) = (peaks, waves);
    let radius = |number: Option<f64>| number.map(|number| 1.0 / number);
    situation.drums = (each.into_iter().map(radius).collect(), radius(all));
    situation
}
