//! Effects of the catalogue, one after the other, as long as they earn their place.

use crate::filter::error::FitError;
use crate::strategy::candidates::signatures;
use crate::strategy::context::Context;
use crate::strategy::every_cable::on_every_cable;
use crate::strategy::form::form;
use crate::strategy::instruments::beside_instruments;
use crate::strategy::onset::onset;
use crate::strategy::round::{Round, round};
use crate::strategy::standing::Standing;
use crate::weigh::signatures::{Signatures, Source};

/// What stands with one more effect of the catalogue, if one earns its place.
pub(crate) fn one_more(context: &Context<'_>, standing: Standing, signatures: &Signatures) -> Result<Round, FitError> {
    round(context, standing, signatures, Source::Catalogue, context.policy.most_refusals)
}

/// Effects of the catalogue, one after the other, as long as they earn their place, and after each the form of friction.
///
/// What the instruments have beside white noise is taken up where it explains more than the next effect.
pub(crate) fn rounds(context: &Context<'_>, mut standing: Standing) -> Result<Standing, FitError> {
    while standing.accepted.len() < context.policy.most_effects {
        let score = standing.fit.score;
        let signatures = signatures(context, &standing, &standing.fit, Source::Catalogue);
        let found = match one_more(context, standing, &signatures)? {
            Round::Instruments(same, better) => {
                standing = beside_instruments(context, same, *better)?;
                if standing.white_force_error() {
                    break;
                }
                continue;
            }
            Round::Found(next) => {
                // As long as more is found, times at which an effect acts may only stand for what is not found yet.
                standing = onset(context, on_every_cable(context, next), context.policy.most);
                true
            }
            Round::Nothing(same) => {
                standing = same;
                false
            }
        };
        standing = form(context, standing);
        if !found && standing.fit.score == score {
            break;
        }
    }
    Ok(standing)
}
