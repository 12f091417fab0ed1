//! The search: which step comes when.

use crate::filter::error::FitError;
use crate::strategy::candidates::signatures;
use crate::strategy::context::Context;
use crate::strategy::drift::instead_of_drift;
use crate::strategy::elasticity::elasticity;
use crate::strategy::evident_delay::evident_delay;
use crate::strategy::form::{form, form_if, settle_extensions};
use crate::strategy::geometry::instead_of_drifts;
use crate::strategy::given_sizes::given_before_more;
use crate::strategy::instruments::{
    beside_instruments, better_instruments, evident_wander, instruments_anew, instruments_instead,
    with_any_error_of_forces, without_idle_instruments,
};
use crate::strategy::late_winches::late_winches;
use crate::strategy::onset::onset;
use crate::strategy::pair::pair;
use crate::strategy::round::Round;
use crate::strategy::rounds::{one_more, rounds, undo_before_more};
use crate::strategy::second_look::{may_hide, second_look};
use crate::strategy::settle::settle;
use crate::strategy::standing::Standing;
use crate::strategy::terms::single_term;
use crate::strategy::undoing::{Others, undoing, undone_in_vain};
use crate::weigh::signatures::Source;

/// A step of the search.
type Step = fn(&Context<'_>, Standing) -> Result<Standing, FitError>;

/// What is done once effects of the catalogue were looked for: their instruments, whether one stood for those, whether a
/// drift stood for some, whether a lateness of the recorder that was undone before did, and whether late clocks are late winches; then
/// they are settled.
const ONCE_FOUND: [Step; 7] = [
    instruments_anew,
    instruments_instead,
    instead_of_drift,
    without_idle_instruments,
    undone_in_vain,
    late_winches,
    settle,
];

/// Looks for effects of the catalogue and settles what was found; terms outside the catalogue are not looked for yet. Where
/// the recorded forces have an error, or the geometry may be off and is, it ends as soon as that is known; and where its time is over, with
/// what stood last.
pub(crate) fn search(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    context.time.keep(&standing);
    context.time.or_what_stood(in_full(context, standing))
}

/// The search, as long as it takes.
fn in_full(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let standing = evident_wander(context, evident_delay(context, standing)?)?;
    let standing = catalogue_rounds(context, standing)?;
    context.time.keep(&standing);
    let standing = with_any_error_of_forces(context, standing)?;
    if standing.begins_anew() {
        return Ok(standing);
    }
    ONCE_FOUND.iter().try_fold(standing, |standing, step| {
        if standing.begins_anew() {
            return Ok(standing);
        }
        context.time.keep(&standing);
        step(context, standing)
    })
}

/// Adds effects of the catalogue as long as they earn their place.
///
/// Where the instruments ask for more than white noise beside laws, the model as given is asked for its own if these may explain as much.
fn catalogue_rounds(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let policy = context.policy;
    let mut standing = elasticity(context, standing)?;
    if standing.accepted.is_empty() {
        standing = first_effect(context, standing)?;
        if standing.begins_anew() {
            return Ok(standing);
        }
    }
    let hidden = may_hide(context, &standing, &standing.base);
    if !standing.accepted.is_empty() {
        if hidden && context.explained(&standing.base, &standing.fit) < policy.hidden {
            standing = match look_again(context, standing)? {
                Look::Explained(explained) => return Ok(explained),
                Look::Better(standing) | Look::Nothing(standing) => standing,
            };
        }
        standing = rounds(context, standing)?;
    }
    if standing.begins_anew() {
        return Ok(standing);
    }
    let little =
        |standing: &Standing| standing.fit.explains_little(&standing.base) || standing.fit.gap[0] > policy.strong;
    if !standing.looked && hidden && little(&standing) {
        standing = match look_again(context, standing)? {
            Look::Explained(explained) => return Ok(explained),
            Look::Better(better) => rounds(context, better)?,
            Look::Nothing(standing) => standing,
        };
    }
    if standing.begins_anew() {
        return Ok(standing);
    }
    // Of what no law explains the instruments may have some.
    if standing.fit.gap[0] > policy.strong
        && let Some(better) = better_instruments(context, &standing.fit, 0.0)?
    {
        standing = beside_instruments(context, standing, better)?;
        if standing.begins_anew() {
            return Ok(standing);
        }
        if standing.accepted.is_empty() {
            return catalogue_rounds(context, standing);
        }
        standing = rounds(context, standing)?;
    }
    Ok(if standing.accepted.len() > 1 && !standing.begins_anew() {
        settle_extensions(context, standing)
    } else {
        standing
    })
}

/// The first effect with its form, or a pair where it leaves a gap.
fn first_effect(context: &Context<'_>, mut standing: Standing) -> Result<Standing, FitError> {
    let policy = context.policy;
    let signatures = loop {
        let signatures = signatures(context, &standing, &standing.fit, Source::Catalogue);
        standing = given_before_more(context, undo_before_more(context, standing, &signatures)?, &signatures)?;
        if standing.begins_anew() {
            return Ok(standing);
        }
        match one_more(context, standing, &signatures)? {
            Round::Instruments(same, better) => {
                if instead_of_drifts(context, &better)? {
                    return Ok(Standing { geometry_is_off: true, ..same });
                }
                standing = Standing::with_base(same, *better);
                if standing.begins_anew() {
                    return Ok(standing);
                }
            }
            Round::Found(next) | Round::Nothing(next) => {
                standing = next;
                break signatures;
            }
        }
    };
    context.time.keep(&standing);
    standing = undoing(context, standing, &Others::MORE)?;
    if standing.begins_anew() {
        return Ok(standing);
    }
    standing = onset(context, standing, policy.most);
    if context.explained(&standing.base, &standing.fit) > policy.most {
        standing = form_if(context, standing, policy.most);
    }
    // Also where none was taken: alone, one of two may not predict the held-out data better.
    context.time.keep(&standing);
    if standing.fit.gap[0] > policy.nothing_left {
        standing = pair(context, standing, &signatures)?;
    }
    Ok(standing)
}

/// What a look for hidden laws brought.
enum Look {
    /// A term that explains all.
    Explained(Standing),
    /// A law that explains more than what was found before.
    Better(Standing),
    Nothing(Standing),
}

/// Where what was found explains little: a term that explains it all, which says more than a law that might hide, or
/// such a law.
fn look_again(context: &Context<'_>, mut standing: Standing) -> Result<Look, FitError> {
    standing.looked = true;
    if let Some(explained) = single_term(context, &standing)? {
        return Ok(Look::Explained(explained));
    }
    Ok(match second_look(context, &standing)? {
        Some(better) => Look::Better(form(context, better)),
        None => Look::Nothing(standing),
    })
}
