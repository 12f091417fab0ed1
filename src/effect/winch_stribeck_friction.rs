//! Stribeck friction in the winch: [F_c + (F_s - F_c) exp(-(l̇/v_s)²)] tanh(l̇/v_0) + c l̇ with v_0 = v_s/10.

use super::presliding::{self, Presliding, in_direction, turned};
use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, WinchContext, parameter, signed};
use crate::scalar::{Real, tanh};

/// Stribeck friction in the winch: [F_c + (F_s - F_c) exp(-(l̇/v_s)²)] tanh(l̇/v_0) + c l̇ with v_0 = v_s/10.
///
/// The transition speed v_0 can be given by itself. With an asymmetry a the dry friction is 1 + a times as large when paying
/// out and 1 - a times when winding in. With a presliding stiffness σ₀ it gives like a spring before it slides, and holds for
/// ever what does not make it slide: it keeps a deflection z (m) on each winch as its state, ż = l̇ - σ₀ z |l̇|/g with
/// g = [F_c + (F_s - F_c) exp(-(l̇/v_s)²)] (1 ± a), and pulls with σ₀ z + σ₁(l̇) ż + c l̇ (LuGre). Then the bristle makes the
/// turn, and v_0 does nothing. The damping is σ₁ exp(-(l̇/v_d)²), and in fast motion less where it would else give energy
/// back that the bristle does not have: 1/(exp((l̇/v_d)²)/σ₁ + |l̇|/D) with D = F_min r²/(r - 1), r the ratio of the larger of
/// F_c and F_s to the smaller, at most 2, and F_min the smaller, in the weaker direction.
///
/// Shows in: tension against winch force: highest just after a reversal.
///
/// Valid for: sliding, with presliding rest and small motions too; without it, at any speed below v_0 the law creeps.
///
/// Source: R. Stribeck, VDI-Zeitschrift 46 (1902); Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994); presliding: Canudas de Wit, Olsson, Åström, Lischinsky, IEEE Trans. Automatic Control 40 (1995).
#[derive(Clone, Debug)]
pub struct WinchStribeckFriction {
    coulomb: f64,
    static_friction: f64,
    stribeck_speed: f64,
    viscous: f64,
    transition_speed: f64,
    asymmetry: f64,
    presliding: Option<Presliding>,
}

/// The law with numbers.
fn law(values: &[f64], number: &dyn Fn(f64) -> String) -> String {
    let [coulomb, static_friction, stribeck, viscous, transition] = values[..5] else {
        unreachable!("the values of a spec are as many as the parameters")
    };
    let turn = if transition > 0.0 { transition } else { stribeck / 10.0 };
    let level = format!(
        "[{} {} exp(-(l̇/{})²)]",
        number(coulomb),
        signed(static_friction - coulomb, number),
        number(stribeck)
    );
    let added = if viscous == 0.0 { String::new() } else { format!(" + {} l̇", number(viscous)) };
    if let Some([pull, deflection]) = presliding::law(values, number) {
        return format!("{pull}{added}, {deflection}, F = {}", presliding::level(&level, values, number));
    }
    let turning = format!("tanh(l̇/{})", number(turn));
    presliding::sliding([&level, &turning, &added], values, number)
}

impl WinchStribeckFriction {
    /// Friction (N) at full sliding in the direction of the speed.
    #[inline]
    fn level<S: Real>(&self, speed: S) -> S {
        let relative = speed / self.stribeck_speed;
        (-(relative * relative)).exp() * (self.static_friction - self.coulomb) + self.coulomb
    }
}

impl Effect for WinchStribeckFriction {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_stribeck_friction",
        title: "Stribeck friction in the winch",
        equation: "[F_c + (F_s - F_c) exp(-(l̇/v_s)²)] tanh(l̇/v_0) + c l̇ with v_0 = v_s/10 if not given; with presliding σ₀ z + σ₁ exp(-(l̇/v_d)²) ż + c l̇, ż = l̇ - σ₀ z |l̇|/g, g the brackets; with asymmetry a: the brackets times 1 ± a",
        law,
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Direction, DependsOn::Speed],
        parameters: &[
            parameter("coulomb", "N", "Coulomb friction F_c", (5.0, 2e3)).at_least(0.0),
            parameter("static", "N", "static friction F_s", (5.0, 4e3)).at_least(0.0),
            parameter("stribeck_speed", "m/s", "Stribeck speed v_s", (1e-3, 1.0)).at_least(1e-9).or(0.05).shape(),
            parameter("viscous", "N.s/m", "viscous coefficient c", (0.0, 1e4)).at_least(0.0).or(0.0).shape(),
            parameter("transition_speed", "m/s", "speed v_0 over which the force turns its sign; 0 is v_s/10", (1e-4, 0.1))
                .at_least(0.0)
                .or(0.0)
                .shape().idle_beside("presliding_stiffness")
                .extension(),
            presliding::PARAMETERS[0],
            presliding::PARAMETERS[1],
            presliding::PARAMETERS[2],
            presliding::PARAMETERS[3],
        ],
        texts: &[],
        shows_in: "tension against winch force: highest just after a reversal",
        source: "R. Stribeck, VDI-Zeitschrift 46 (1902); Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994); presliding: Canudas de Wit, Olsson, Åström, Lischinsky, IEEE Trans. Automatic Control 40 (1995)",
        validity: "sliding, with presliding rest and small motions too; without it, at any speed below v_0 the law creeps",
        look_alikes: &[
            LookAlike { id: "winch_coulomb_friction", separate_by: "slow and fast reversals" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        let [coulomb, static_friction, stribeck_speed, viscous, transition] = spec.values[..5] else {
            unreachable!("the values of a spec are as many as the parameters")
        };
        // Ten times faster than the Stribeck dip, so that the peak F_s is visible.
        let transition_speed = if transition > 0.0 { transition } else { stribeck_speed / 10.0 };
        let levels = [coulomb.min(static_friction), coulomb.max(static_friction)];
        let presliding = Presliding::new(spec, levels)?;
        let asymmetry = spec.values[spec.values.len() - 1];
        Ok(Self { coulomb, static_friction, stribeck_speed, viscous, transition_speed, asymmetry, presliding })
    }

    fn stage(&self) -> Stage {
        Stage::WinchLoss
    }

    fn loss<S: Real>(&self, _force: S, context: &WinchContext<S>) -> S {
        let sign = turned(tanh(context.speed / self.transition_speed), self.asymmetry);
        self.level(context.speed) * sign + context.speed * self.viscous
    }

    fn states(&self) -> usize {
        usize::from(self.presliding.is_some())
    }

    fn loss_in<S: Real>(&self, force: S, states: &[S], rates: &mut [S], context: &WinchContext<S>) -> S {
        let Some(presliding) = &self.presliding else { return self.loss(force, context) };
        let level = self.level(context.speed) * in_direction(context.speed, self.asymmetry);
        presliding.pull(context.speed, level, states[0], &mut rates[0]) + context.speed * self.viscous
    }

    fn loss_state_size(&self) -> f64 {
        self.presliding.as_ref().map_or(1.0, |p| p.size(self.static_friction))
    }
}
