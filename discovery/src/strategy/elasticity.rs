//! A rigid model of elastic cables: the paper's own story, tried before anything else.

use crate::data::Channel;
use crate::data::clean::median;
use crate::filter::error::FitError;
use crate::hypothesis::elasticity::{elastic_cables, plausible};
use crate::journal::Outcome;
use crate::strategy::context::Context;
use crate::strategy::entrance::enter;
use crate::strategy::fitted::Fitted;
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::signatures::Source;

/// What stands with elastic cables, where its cables are rigid and that earns its place.
pub(crate) fn elasticity(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let fitted = &standing.fit;
    if fitted.train.examined.plant.unstretched_index(0).is_some() {
        return Ok(standing);
    }
    (context.progress)("trying elastic cables", 0.08);
    let parameters = &fitted.train.model.parameters;
    let guess = stiffness_guess(context, fitted).unwrap_or(parameters.axial_stiffness());
    let effect = elastic_cables(guess, parameters.cable_damping);
    let effect = effect.map_err(|error| FitError::Model(error.to_string()))?;
    let mut model = fitted.train.model.clone();
    model.effects.push(effect.clone());
    let next = context.journal.tried(&effect, "it cannot be fitted", context.fit(&model, fitted));
    let Some(next) = next else { return Ok(standing) };
    if next.score < fitted.score - EVIDENCE && next.helps(fitted, context.policy) {
        let entered = enter(context, &standing, next, vec![Vec::new()], Source::Catalogue, "")?.entered();
        return Ok(entered.unwrap_or(standing));
    }
    let change = next.score - fitted.score;
    context.journal.note(&effect, Outcome::Refused, change, "rigid cables explain the data as well");
    Ok(standing)
}

/// Axial stiffness (N) from the mean stretch under the mean winch force.
fn stiffness_guess(context: &Context<'_>, fitted: &Fitted) -> Option<f64> {
    let mut ratios = Vec::new();
    for (t, trial) in context.evidence.train.iter().enumerate() {
        for i in 0..trial.cables() {
            let Some(j) = trial.channels.iter().position(|c| *c == Channel::UnstretchedLength(i)) else { continue };
            for k in (0..trial.len()).step_by(20) {
                let y = fitted.train.trajectories[t].states(k);
                let geometry = fitted.train.examined.plant.geometry();
                let length = cdpr::kinematics::cable_lengths(geometry, &[y[0], y[1], y[2]])[i];
                let l = trial.measured[k][j];
                let ratio = trial.inputs[k].winch_force[i] * l / (length - l);
                if ratio.is_finite() && ratio > 0.0 {
                    ratios.push(ratio);
                }
            }
        }
    }
    let guess = median(ratios);
    plausible(guess).then_some(guess)
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;
    use cdpr::parameters::CableModel;

    use super::*;
    use crate::strategy::fixture::{begun, evidence, names};

    #[test]
    fn a_rigid_model_of_elastic_cables_gets_their_stiffness() {
        let evidence = evidence(&[], 79);
        let mut rigid = Model::default();
        rigid.parameters.cable_model = CableModel::Rigid;
        let (context, standing) = begun(&evidence, &rigid);
        let standing = elasticity(&context, standing).expect("a fit");
        assert_eq!(names(&context, &standing), [("cable_elasticity".to_owned(), None)]);
        let ratio = standing.found(&context)[0].values[0] / rigid.parameters.axial_stiffness();
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    }
}
