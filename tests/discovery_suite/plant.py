"""The equations of motion, derived again, and a fixed-step Runge-Kutta integrator.

Unknowns are the platform's acceleration `(ax, ay, phi'')`. With `s_i = (S, E x S)` and
`n_i = (N, E . S)` the rows that turn the platform's velocity into a cable's axial and transverse
end velocity, the principle of virtual power gives the wrench of a cable on the platform as
`-T s_i + Q n_i`, and the inertia of a uniform rod pivoted at its anchor, seen at its far end, as
`(rho L / 3) n_i n_i^T`. All that is left is to gather terms in the acceleration:

    [ P + sum (rho L/3) n n^T (+ (rho L/2 + drum) s s^T when rigid) ] q'' = forces

where `P` is the platform's mass matrix about its centre `G`, with a centre of mass at `r = R c`.
Applied forces (wind, drag, umbilical, disturbances) act at `G`; the moment of inertia is about the
centre of mass. Winch side, pull positive, in this order: command, delay, saturation, lag, gain,
bias, losses (capstan, then friction); a loss adds to the pull while the cable is paid out.

State: `x y phi vx vy omega | l | l' | lagged force | creep strain | bristle | share of the
hysteresis`, one of each for a cable. A pendulum, outside the catalogue, has the first two of the
last.
Gravity acts on the platform at its centre of mass.
"""

import math

import numpy as np
from numba import njit

from .parameters import AIR_DENSITY

# Points along a cable and their weights, for the wind on it (Gauss and Legendre).
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(10)
ALONG, WEIGHT = 0.5 * (_POINTS + 1.0), 0.5 * _WEIGHTS


@njit(cache=True, error_model="numpy")
def state_count(p):
    """Number of states of this robot."""
    return 6 + 6 * int(p.cables)


@njit(cache=True, error_model="numpy")
def layout(p):
    """Number of cables, and the first states of each group in the order above."""
    n = int(p.cables)
    return n, 6, 6 + n, 6 + 2 * n, 6 + 3 * n, 6 + 4 * n, 6 + 5 * n


@njit(cache=True, error_model="numpy")
def smooth_sign(law, v, width):
    """Sign of `v`, smoothed over `width` by the law with this code."""
    if law == 1.0:
        return 2.0 / math.pi * math.atan(v / width)
    if law == 2.0:
        return v / math.sqrt(v * v + width * width)
    return math.tanh(v / width)


@njit(cache=True, error_model="numpy")
def hardening_strain(ea, beta, tension):
    """Elastic strain that carries `tension` under `T = ea e (1 + beta e^2)`, by Newton."""
    e = tension / ea
    for _ in range(50):
        f = ea * e * (1.0 + beta * e * e) - tension
        de = f / (ea * (1.0 + 3.0 * beta * e * e))
        e -= de
        if abs(de) < 1e-17:
            break
    return e


@njit(cache=True, error_model="numpy")
def elastic_tension(p, i, chord, strain):
    """Elastic tension (N) of cable `i` at this total strain less creep; zero when slack.

    With sag the chord strain is `e(T) - (w L)^2/24 (1/T^2 - 1/T_ref^2)`, increasing and concave in
    `e`, so that Newton from the left converges without overshoot.
    """
    ea, beta = p.ea[i], p.beta[i]
    if p.sag_weight[i] == 0.0:
        if strain <= 0.0:
            return 0.0
        return ea * strain * (1.0 + beta * strain * strain)
    load = p.sag_weight[i] * chord
    c = load * load / 24.0
    offset = c / (p.sag_tension[i] * p.sag_tension[i])
    e = 0.5 * max(strain, 1e-4)
    for _ in range(80):
        tension = ea * e * (1.0 + beta * e * e)
        slope = ea * (1.0 + 3.0 * beta * e * e)
        f = e - c / (tension * tension) + offset - strain
        new = e - f / (1.0 + 2.0 * c * slope / (tension * tension * tension))
        if new <= 0.0:
            new = 0.5 * e
        done = abs(new - e) < 1e-16
        e = new
        if done:
            break
    return ea * e * (1.0 + beta * e * e)


@njit(cache=True, error_model="numpy")
def chord_strain(p, i, chord, tension):
    """Strain of cable `i` without creep that carries `tension`: the inverse of the above."""
    e = hardening_strain(p.ea[i], p.beta[i], tension)
    if p.sag_weight[i] != 0.0:
        load = p.sag_weight[i] * chord
        reference = p.sag_tension[i]
        e -= load * load / 24.0 * (1.0 / (tension * tension) - 1.0 / (reference * reference))
    return e


@njit(cache=True, error_model="numpy")
def thermal_strain(p, t):
    """Thermal strain of all cables at time `t`."""
    if p.thermal_amplitude == 0.0:
        return 0.0
    return p.thermal_amplitude * math.sin(2.0 * math.pi * t / p.thermal_period + p.thermal_phase)


@njit(cache=True, error_model="numpy")
def winch_loss(p, i, v, pull, bristle):
    """Pull (N) added by friction at pay-out speed `v`, and the bristle's rate."""
    loss = p.viscous[i] * v
    if p.capstan[i] != 0.0:
        loss += p.capstan[i] * pull * math.tanh(v / p.capstan_speed[i])
    if p.wrap[i] != 0.0:
        # The force behind the pulleys is exp(mu theta) times that before them, one way.
        loss += abs(pull) * (math.exp(p.wrap[i] * math.tanh(v / p.wrap_speed[i])) - 1.0)
    rate = 0.0
    if p.coulomb[i] != 0.0 or p.static[i] != 0.0:
        ratio = v / p.stribeck_speed[i]
        level = p.coulomb[i] + (p.static[i] - p.coulomb[i]) * math.exp(-ratio * ratio)
        if p.friction_law[i] == 3.0:
            stiffness = p.bristle_stiffness[i]
            rate = v - stiffness * abs(v) / level * bristle
            # Bristle damping fades with speed, so that full sliding carries `level` exactly.
            fade = math.exp(-(v * v) / (25.0 * p.smoothing[i] * p.smoothing[i]))
            loss += stiffness * bristle + p.bristle_damping[i] * fade * rate
        else:
            way = smooth_sign(p.friction_law[i], v, p.smoothing[i])
            loss += level * (way + p.asymmetry[i] * way * way)
    return loss, rate


@njit(cache=True, error_model="numpy")
def solve3(m, r):
    """Solve the symmetric 3 by 3 system in place by elimination without pivoting."""
    f = m[1, 0] / m[0, 0]
    m11 = m[1, 1] - f * m[0, 1]
    m12 = m[1, 2] - f * m[0, 2]
    r1 = r[1] - f * r[0]
    g = m[2, 0] / m[0, 0]
    m21 = m[2, 1] - g * m[0, 1]
    m22 = m[2, 2] - g * m[0, 2]
    r2 = r[2] - g * r[0]
    h = m21 / m11
    z = (r2 - h * r1) / (m22 - h * m12)
    y = (r1 - m12 * z) / m11
    r[0] = (r[0] - m[0, 1] * y - m[0, 2] * z) / m[0, 0]
    r[1] = y
    r[2] = z


@njit(cache=True, error_model="numpy")
def wind_share(p, anchor_y, chord, rise, across, turn):
    """What the platform's end carries (N, along N) of the wind on a cable.

    The cable stands like a beam on two supports: of a force at a share of its length, that share.
    `rise` is the sine of its slope, `across` the wind along N at the reference height.
    """
    force = 0.0
    for k in range(len(ALONG)):
        place = ALONG[k] * chord
        wind = across
        if p.air_exponent != 0.0:
            height = (anchor_y + place * rise - p.air_ground) / p.air_reference
            wind = across * height**p.air_exponent if height > 0.0 else 0.0
        relative = wind - place * turn
        force += WEIGHT[k] * ALONG[k] * abs(relative) * relative
    return 0.5 * AIR_DENSITY * p.air_area * chord * force


@njit(cache=True, error_model="numpy")
def leaving(p, i, dx, dz):
    """Direction, straight part and whole length of cable `i` to `dx`, `dz` from its anchor.

    A pulley of radius r about the anchor stands to the right of a cable that leaves it (r > 0): by
    the angle asin(r/d) its direction is turned from that of the end. The length counts what comes
    onto the pulley from where the platform is at zero.
    """
    distance = math.sqrt(dx * dx + dz * dz)
    radius = p.pulley[i]
    if radius == 0.0:
        return dx / distance, dz / distance, distance, distance
    hx, hz = p.body_x[i] - p.anchor_x[i], p.body_y[i] - p.anchor_y[i]
    home = math.atan2(hz, hx) - math.asin(radius / math.sqrt(hx * hx + hz * hz))
    direction = math.atan2(dz, dx) - math.asin(radius / distance)
    turned = (direction - home + math.pi) % (2.0 * math.pi) - math.pi
    span = math.sqrt(distance * distance - radius * radius)
    return math.cos(direction), math.sin(direction), span, span - radius * turned


@njit(cache=True, error_model="numpy")
def pendulum(p, y):
    """Force (N) along x of a mass on a spring and a damper; the first two shares of the hysteresis
    are its place from the platform's (m) and its speed (m/s)."""
    first, c = layout(p)[6], p.outside_coefficients
    stiffness, damping = c[0] * c[1] * c[1], 2.0 * c[2] * c[0] * c[1]
    return stiffness * y[first] + damping * (y[first + 1] - y[3])


@njit(cache=True, error_model="numpy")
def platform_wrench(p, t, y, wrench):
    """Add the applied wrench on the platform (not the cables') to `wrench`."""
    vx, vy, omega = y[3], y[4], y[5]
    wrench[0] += p.steady_x - p.linear_drag * vx
    wrench[1] += p.steady_y - p.linear_drag * vy
    wrench[2] += p.steady_torque - p.rotational_damping * omega
    rx, ry = vx - p.wind_x, vy - p.wind_y
    drag = p.quadratic_drag * math.sqrt(rx * rx + ry * ry)
    wrench[0] -= drag * rx
    wrench[1] -= drag * ry
    if p.gust_amplitude != 0.0:
        gust = p.gust_amplitude * math.sin(p.gust_frequency * t + p.gust_phase)
        wrench[0] += gust * math.cos(p.gust_direction)
        wrench[1] += gust * math.sin(p.gust_direction)
    wrench[0] -= p.umbilical_k * (y[0] - p.umbilical_x) + p.umbilical_d * vx
    wrench[1] -= p.umbilical_k * (y[1] - p.umbilical_y) + p.umbilical_d * vy
    c = p.outside_coefficients
    if p.outside == 1.0:
        wrench[0] += c[0] * vy
    elif p.outside == 2.0:
        wrench[0] -= c[0] * y[0] * abs(y[1])
    elif p.outside == 3.0:
        wrench[1] -= c[0] * y[1] * y[1] * y[1]
    elif p.outside == 4.0:
        wrench[2] += c[0] * math.tanh(5.0 * math.sin(c[1] * t))
    elif p.outside == 5.0:
        wrench[2] += c[0] * vx * vy
    elif p.outside == 7.0:
        wrench[0] += c[0] * math.sin(2.0 * math.pi * y[0] / c[1])
    elif p.outside == 8.0:
        wrench[1] += c[0] * omega * vx
    elif p.outside == 11.0:
        wrench[0] -= c[0] * math.tanh(vx / 0.02) * 0.5 * (1.0 + math.tanh((y[0] - c[1]) / 0.05))
    elif p.outside == 12.0:
        wrench[0] += pendulum(p, y)


@njit(cache=True, error_model="numpy")
def derivative(p, t, y, command, disturbance, dy, tension):
    """Write the state's time derivative to `dy` and the tensions (N) to `tension`.

    `command` are the winch forces after their delay, `disturbance` the wrench at G.
    """
    cables, own, payouts, lagged, creep, bristles, ropes = layout(p)
    phi, vx, vy, omega = y[2], y[3], y[4], y[5]
    cos, sin = math.cos(phi), math.sin(phi)
    com_x = cos * p.com_x - sin * p.com_y
    com_y = sin * p.com_x + cos * p.com_y
    m = np.zeros((3, 3))
    m[0, 0] = m[1, 1] = p.mass
    m[0, 2] = m[2, 0] = -p.mass * com_y
    m[1, 2] = m[2, 1] = p.mass * com_x
    m[2, 2] = p.inertia + p.mass * (com_x * com_x + com_y * com_y)
    r = np.empty(3)
    weight_x, weight_y = p.mass * p.gravity_x, p.mass * p.gravity_y
    r[0] = disturbance[0] + p.mass * omega * omega * com_x + weight_x
    r[1] = disturbance[1] + p.mass * omega * omega * com_y + weight_y
    r[2] = disturbance[2] + com_x * weight_y - com_y * weight_x
    platform_wrench(p, t, y, r)

    stretch = 1.0 + thermal_strain(p, t)
    n, s, c = np.empty(3), np.empty(3), p.outside_coefficients
    for i in range(cables):
        ex = cos * p.body_x[i] - sin * p.body_y[i]
        ey = sin * p.body_x[i] + cos * p.body_y[i]
        dx, dz = y[0] + ex - p.anchor_x[i], y[1] + ey - p.anchor_y[i]
        s[0], s[1], span, chord = leaving(p, i, dx, dz)
        s[2] = ex * s[1] - ey * s[0]
        n[0], n[1] = -s[1], s[0]
        n[2] = ex * s[0] + ey * s[1]
        e_n = ex * n[0] + ey * n[1]
        rate = s[0] * vx + s[1] * vy + s[2] * omega
        turn = (n[0] * vx + n[1] * vy + n[2] * omega) / span
        span_rate = rate + p.pulley[i] * turn
        # The part of L'' that does not hold an acceleration.
        bend = span * turn * turn - omega * omega * n[2]

        pull = min(max(command[i], p.lower[i]), p.upper[i])
        dy[lagged + i] = 0.0
        if p.lag[i] > 0.0:
            dy[lagged + i] = (pull - y[lagged + i]) / p.lag[i]
            pull = y[lagged + i]
        pull = pull * (1.0 + p.gain[i]) + p.bias[i]
        if p.ripple[i] != 0.0:
            paid_out = chord if p.rigid else y[own + i]
            angle = 2.0 * math.pi * paid_out / p.ripple_period[i] + p.ripple_phase[i]
            pull += p.ripple[i] * math.sin(angle)
        if p.outside == 6.0 and i == int(c[2]) - 1:
            pull += c[0] * math.sin((chord if p.rigid else y[own + i]) / c[1])
        if p.outside == 9.0 and i == int(c[2]) - 1:
            pull += c[0] * command[int(c[1]) - 1]
        speed = rate if p.rigid else y[payouts + i]
        loss, dy[bristles + i] = winch_loss(p, i, speed, pull, y[bristles + i])
        pull += loss

        inertia = p.rho * span / 3.0
        quiet = inertia * (omega * omega * e_n + (rate + span_rate) * turn)
        quiet -= p.rho * span * span_rate * turn
        quiet -= 0.125 * AIR_DENSITY * p.drag_area[i] * span**3 * abs(turn) * turn
        if p.air_area != 0.0:
            across = n[0] * p.air_x + n[1] * p.air_y
            quiet += wind_share(p, p.anchor_y[i], span, s[1], across, turn)
        dy[creep + i] = dy[ropes + i] = 0.0
        if p.rigid:
            axial = 0.5 * p.rho * chord + p.drum[i]
            known = pull + axial * bend
            known += 0.5 * p.rho * (rate * rate - chord * chord * turn * turn)
            tension[i] = known
            dy[own + i] = dy[payouts + i] = 0.0
        else:
            axial = 0.0
            length, payout = y[own + i], y[payouts + i]
            warm = length * stretch
            strain = (chord - warm) / warm
            elastic = elastic_tension(p, i, chord, strain - y[creep + i])
            # The mast gives by T/k: so much less is left to be stretched.
            elastic /= 1.0 + p.ea[i] / (p.mast[i] * warm)
            # Bouc and Wen beside the spring, with the exponent 1.
            elastic += p.rope[i] * y[ropes + i]
            if p.rope[i] > 0.0 and elastic > 0.0:
                straining = (rate - payout * chord / length) / length
                rub = straining - abs(straining) * y[ropes + i]
                dy[ropes + i] = rub / p.rope_strain[i]
            known = 0.0
            if elastic > 0.0:
                known = max(elastic + p.bl[i] / length * (rate - payout), 0.0)
            if p.creep_ea[i] > 0.0:
                dy[creep + i] = (elastic / p.creep_ea[i] - y[creep + i]) / p.creep_tau[i]
            tension[i] = known
            lumped = 0.5 * p.rho * length + p.drum[i]
            gyro = 0.5 * p.rho * (length * length * turn * turn - payout * payout)
            dy[own + i] = payout
            dy[payouts + i] = (known - pull + gyro) / lumped
        for a in range(3):
            r[a] += n[a] * quiet - s[a] * known
            for b in range(3):
                m[a, b] += inertia * n[a] * n[b] + axial * s[a] * s[b]
    if p.outside == 12.0:
        dy[ropes] = y[ropes + 1] - vx
        dy[ropes + 1] = -pendulum(p, y) / c[0]
    solve3(m, r)
    dy[0], dy[1], dy[2] = vx, vy, omega
    dy[3], dy[4], dy[5] = r[0], r[1], r[2]
    if p.rigid:
        for i in range(cables):
            ex = cos * p.body_x[i] - sin * p.body_y[i]
            ey = sin * p.body_x[i] + cos * p.body_y[i]
            dx, dz = y[0] + ex - p.anchor_x[i], y[1] + ey - p.anchor_y[i]
            sx, sy, _, chord = leaving(p, i, dx, dz)
            along = sx * r[0] + sy * r[1] + (ex * sy - ey * sx) * r[2]
            tension[i] += (0.5 * p.rho * chord + p.drum[i]) * along


@njit(cache=True, error_model="numpy")
def advance(p, t, span, steps, y, command, d0, d1, s0, s1, work):
    """Integrate `y` in place over `span` by `steps` classical Runge-Kutta steps.

    The disturbance runs linearly from `d0 + s0 (d1 - d0)` to `d0 + s1 (d1 - d0)`.
    """
    states = len(y)
    k, tension, d = work[:4], work[4], work[5, :3]
    z = work[6]
    h = span / steps
    for step in range(steps):
        for stage in range(4):
            frac = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            s = s0 + (s1 - s0) * (step + frac) / steps
            for a in range(3):
                d[a] = d0[a] + s * (d1[a] - d0[a])
            for j in range(states):
                z[j] = y[j] if stage == 0 else y[j] + frac * h * k[stage - 1, j]
            derivative(p, t + (step + frac) * h, z, command, d, k[stage], tension)
        for j in range(states):
            y[j] += h / 6.0 * (k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j])


@njit(cache=True, error_model="numpy")
def split_delay(delay, dt):
    """A delay as whole sample intervals and the rest of one (s)."""
    whole = math.floor(delay / dt + 1e-9)
    rest = delay - whole * dt
    return whole, (rest if rest > 1e-9 else 0.0)


@njit(cache=True, error_model="numpy")
def interval(p, k, t, dt, h, y, commands, recorded, hidden, tap_at, tap, work):
    """Integrate `y` in place over sample interval `k`, from `t` to `t + dt`.

    `commands` (n, cables) and `recorded` (n, 3) are held over the interval; `hidden` (n + 1, 3) is
    interpolated linearly. Delayed commands switch inside the interval, so it is cut there; it is
    cut at `t + tap_at` as well, where the pose is copied to `tap` (for a delayed pose sensor).
    """
    cables = int(p.cables)
    cuts = np.empty(cables + 2)
    count = 0
    for i in range(cables + 1):
        rest = tap_at if i == cables else split_delay(p.delay[i], dt)[1]
        if rest > 0.0:
            j = count
            while j > 0 and cuts[j - 1] > rest:
                cuts[j] = cuts[j - 1]
                j -= 1
            cuts[j] = rest
            count += 1
    cuts[count] = dt
    command = np.empty(cables)
    d0, d1 = np.empty(3), np.empty(3)
    for a in range(3):
        d0[a] = recorded[k, a] + hidden[k, a]
        d1[a] = recorded[k, a] + hidden[k + 1, a]
    if tap_at == 0.0:
        tap[:] = y[:3]
    start = 0.0
    for piece in range(count + 1):
        end = cuts[piece]
        if end - start > 1e-12:
            middle = 0.5 * (start + end)
            for i in range(cables):
                whole, rest = split_delay(p.delay[i], dt)
                source = k - whole - (1 if middle < rest else 0)
                command[i] = commands[max(source, 0), i]
            steps = math.ceil((end - start) / h - 1e-9)
            advance(
                p, t + start, end - start, steps, y, command, d0, d1, start / dt, end / dt, work
            )
        if tap_at > 0.0 and end == tap_at:
            tap[:] = y[:3]
        start = end


@njit(cache=True, error_model="numpy")
def replay(p, t0, dt, h, y0, first, last, commands, recorded, hidden):
    """Integrate open loop from sample `first` to `last`; states at samples first..last."""
    work = np.zeros((7, len(y0)))
    out = np.empty((last - first + 1, len(y0)))
    y, tap = y0.copy(), np.empty(3)
    out[0] = y
    for k in range(first, last):
        interval(p, k, t0 + k * dt, dt, h, y, commands, recorded, hidden, 0.0, tap, work)
        out[k - first + 1] = y
    return out


@njit(cache=True, error_model="numpy")
def lengths(p, pose, out):
    """Geometric cable lengths (m) at a pose."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    for i in range(int(p.cables)):
        dx = pose[0] + cos * p.body_x[i] - sin * p.body_y[i] - p.anchor_x[i]
        dz = pose[1] + sin * p.body_x[i] + cos * p.body_y[i] - p.anchor_y[i]
        out[i] = leaving(p, i, dx, dz)[3]


@njit(cache=True, error_model="numpy")
def at_rest(p, t, pose, command):
    """State at rest at `pose`, every spring carrying its winch's pull, creep fully settled."""
    cables, own, _, lagged, creep, _, _ = layout(p)
    y = np.zeros(state_count(p))
    y[:3] = pose
    chord = np.empty(cables)
    lengths(p, pose, chord)
    for i in range(cables):
        pull = min(max(command[i], p.lower[i]), p.upper[i])
        y[lagged + i] = pull
        pull = pull * (1.0 + p.gain[i]) + p.bias[i]
        if p.creep_ea[i] > 0.0:
            y[creep + i] = pull / p.creep_ea[i]
        free = 0.0
        # The ripple goes by the length that it changes a little itself.
        for _ in range(8 if p.ripple[i] != 0.0 else 1):
            angle = 2.0 * math.pi * free / p.ripple_period[i] + p.ripple_phase[i]
            held = pull + p.ripple[i] * math.sin(angle)
            strain = chord_strain(p, i, chord[i], held) + y[creep + i]
            stretched = chord[i] - held / p.mast[i]
            free = stretched / (1.0 + strain) / (1.0 + thermal_strain(p, t))
        y[own + i] = free
    return y
