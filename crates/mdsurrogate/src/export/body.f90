    ! log(1 + t) to rounding: Kahan's correction
    pure real(dp) function log1p(t)
        real(dp), intent(in) :: t
        real(dp) :: u
        u = 1 + t
        if (u <= 1) then
            log1p = t
        else
            log1p = log(u) * (t / (u - 1))
        end if
    end function log1p

    subroutine neuron(kind_of, x, y, d, dd)
        integer, intent(in) :: kind_of
        real(dp), intent(in) :: x
        real(dp), intent(out) :: y, d, dd
        real(dp) :: small, s, slope
        small = exp(-abs(x))
        s = merge(small, 1.0_dp, x < 0) / (1 + small)
        slope = s * (1 - s)
        select case (kind_of)
        case (1)
            y = merge(0.0_dp, x, x <= 0)
            d = merge(0.0_dp, 1.0_dp, x <= 0)
            dd = 0
        case (2)
            y = merge(0.0_dp, x, x < 0) + log1p(small)
            d = s
            dd = slope
        case (3)
            y = tanh(x)
            d = 1 - y * y
            dd = -2 * y * d
        case (4)
            y = s
            d = slope
            dd = slope * (1 - 2 * s)
        case (5)
            y = x * s
            d = s + x * slope
            dd = slope * (2 + x * (1 - 2 * s))
        case (6)
            y = merge(x, small - 1, x > 0)
            d = merge(1.0_dp, small, x > 0)
            dd = merge(0.0_dp, small, x > 0)
        case default
            y = x
            d = 1
            dd = 0
        end select
    end subroutine neuron

    ! recursive: local arrays are then never static, and threads do not share them
    ! first: S of a map, dW/dC of an energy; second: its derivative by C
    recursive subroutine member(m, c, value, first, second)
        integer, intent(in) :: m
        real(dp), intent(in) :: c(6)
        real(dp), intent(out) :: value, first(6), second(6, 6)
        real(dp) :: x(INPUTS), d(INPUTS, 6), dd(INPUTS, 6, 6), local(6), t(6, 6), hessian(INPUTS, INPUTS)
        real(dp) :: y(WIDEST, 0:LAYERS), dy(WIDEST, LAYERS), ddy(WIDEST, LAYERS)
        real(dp) :: total(INPUTS, WIDEST, LAYERS), slope(INPUTS, WIDEST, 0:LAYERS)
        real(dp) :: g(WIDEST), gb(WIDEST), f(6), h(6, 6), correction, z, v, weight_i
        integer :: start(LAYERS), at, corrections, l, k, i, j, a, b
        t = transpose(reshape(turn, [6, 6]))
        local = matmul(t, c)
        call features(local, x, d, dd)
        corrections = RESTS * (m - 1) + 7
        correction = 0
        y = 0
        slope = 0
        do i = 1, INPUTS
            correction = correction + rest(corrections + i) * (x(i) - rest(corrections + INPUTS + i))
            y(i, 0) = (x(i) - mean(i)) * inverse(i)
            slope(i, i, 0) = 1
        end do
        at = (m - 1) * PARAMETERS
        do l = 1, LAYERS
            start(l) = at
            do k = 1, width(l + 1)
                z = weight(at + width(l) * width(l + 1) + k)
                total(:, k, l) = 0
                do j = 1, width(l)
                    v = weight(at + (k - 1) * width(l) + j)
                    z = z + v * y(j, l - 1)
                    total(:, k, l) = total(:, k, l) + v * slope(:, j, l - 1)
                end do
                call neuron(activation(l), z, y(k, l), dy(k, l), ddy(k, l))
                slope(:, k, l) = dy(k, l) * total(:, k, l)
            end do
            at = at + (width(l) + 1) * width(l + 1)
        end do
        value = 0
        first = 0
        second = 0
        if (ENERGETIC == 0) then
            do a = 1, min(6, OUTPUTS)
                first(a) = output_mean(a) + output(a) * y(a, LAYERS)
                do b = 1, min(6, INPUTS)
                    second(a, b) = output(a) * slope(b, a, LAYERS) * inverse(b)
                end do
            end do
            return
        end if
        hessian = 0
        g = 0
        g(1) = 1
        do l = LAYERS, 1, -1
            gb = 0
            do k = 1, width(l + 1)
                do i = 1, INPUTS
                    hessian(:, i) = hessian(:, i) + g(k) * ddy(k, l) * total(i, k, l) * total(:, k, l)
                end do
                do j = 1, width(l)
                    gb(j) = gb(j) + g(k) * dy(k, l) * weight(start(l) + (k - 1) * width(l) + j)
                end do
            end do
            g = gb
        end do
        f = 0
        h = 0
        do i = 1, INPUTS
            weight_i = output(1) * g(i) * inverse(i) + rest(corrections + i)
            f = f + weight_i * d(i, :)
            h = h + weight_i * dd(i, :, :)
            do j = 1, INPUTS
                v = output(1) * hessian(i, j) * inverse(i) * inverse(j)
                do b = 1, 6
                    h(:, b) = h(:, b) + v * d(i, :) * d(j, b)
                end do
            end do
        end do
        value = output(1) * y(1, LAYERS) + correction
        first = matmul(transpose(t), f)
        second = matmul(transpose(t), matmul(h, t))
    end subroutine member

    ! The mean of the members. status 0; 1: C is not positive definite or not finite; 2: the result is not finite
    recursive subroutine evaluate(c, s, tangent, energy, spread, flags, status)
        use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
        real(dp), intent(in) :: c(6)
        real(dp), intent(out) :: s(6), tangent(6, 6), energy, spread
        integer, intent(out) :: flags, status
        real(dp) :: all_s(6, MEMBERS), second(6, 6), two(6), unit(6), own(6), value, minor, determinant, low, high
        real(dp) :: nearest, slack
        integer :: a, b, m, count
        s = 0
        tangent = 0
        energy = 0
        spread = 0
        flags = 0
        status = 1
        if (.not. all(ieee_is_finite(c))) return
        minor = c(1) * c(2) - c(4) * c(4)
        determinant = c(1) * (c(2) * c(3) - c(6) * c(6)) - c(4) * (c(4) * c(3) - c(6) * c(5)) &
            + c(5) * (c(4) * c(6) - c(2) * c(5))
        if (.not. (c(1) > 0 .and. minor > 0 .and. determinant > 0)) return
        two = [2, 2, 2, 1, 1, 1]
        unit = [1, 1, 1, 0, 0, 0]
        do m = 1, MEMBERS
            call member(m, c, value, all_s(:, m), second)
            own = rest(RESTS * (m - 1) + 1:RESTS * (m - 1) + 6)
            if (ENERGETIC == 1) then
                energy = energy + (value - rest(RESTS * (m - 1) + 7) - sum(own * (c - unit))) / MEMBERS
                all_s(:, m) = two * (all_s(:, m) - own)
                do b = 1, 6
                    second(:, b) = two * second(:, b)
                end do
            end if
            s = s + all_s(:, m) / MEMBERS
            do b = 1, 6
                tangent(:, b) = tangent(:, b) + second(:, b) * two(b) / MEMBERS
            end do
        end do
        do m = 1, MEMBERS
            spread = spread + sum((all_s(:, m) - s)**2)
        end do
        spread = sqrt(spread / MEMBERS)
        do a = 1, 6
            low = training_box(2 * a - 1)
            high = training_box(2 * a)
            slack = merge(0.0_dp, UNSEEN, low < high)
            if (.not. (c(a) >= low - slack .and. c(a) <= high + slack)) then
                flags = ibset(flags, a - 1)
                if (.not. low < high) flags = ibset(flags, a + 5)
            end if
        end do
        if (spread > SPREAD_LIMIT) flags = ibset(flags, 12)
        count = REPRESENTATIVES
        if (count > 0) then
            nearest = huge(1.0_dp)
            do m = 1, count
                nearest = min(nearest, &
                    sum(((representative(6 * m - 5:6 * m) - c) * representative_weight)**2))
            end do
            if (sqrt(nearest) > FARTHEST) flags = ibset(flags, 13)
        end if
        status = 2
        if (all(ieee_is_finite(s)) .and. all(ieee_is_finite(tangent))) status = 0
    end subroutine evaluate

    ! The damage variable of unloading: S and its tangent with it; the greatest energy of the history is brought up to date.
    subroutine soften(energy, greatest, s, tangent)
        real(dp), intent(in) :: energy
        real(dp), intent(inout) :: greatest, s(6), tangent(6, 6)
        real(dp) :: total, slope, fall, reached
        integer :: k, b
        greatest = max(greatest, energy)
        if (UNITS == 0 .or. energy >= greatest) return
        total = 0
        slope = 0
        do k = 1, size(softening), 3
            reached = softening(k) * min(1d12, (greatest / GREATEST_SEEN)**softening(k + 2))
            fall = tanh(softening(k + 1) * (1 - energy / greatest))
            total = total + reached * fall
            slope = slope - reached * (1 - fall * fall) * softening(k + 1) / greatest
        end do
        do b = 1, 6
            tangent(:, b) = exp(-total) * (tangent(:, b) - slope * s(b) * s)
        end do
        s = exp(-total) * s
    end subroutine soften

    ! of a law with damage, J/m3: what an unloading to rest gives back at W = energy with the greatest energy of the history,
    ! the integral of exp(-total) over W; Gauss points of 200 intervals that shrink towards the greatest energy
    real(dp) function recovered(energy, greatest)
        real(dp), intent(in) :: energy, greatest
        real(dp), parameter :: place = 0.5773502691896257_dp
        real(dp) :: total, w, low, high
        integer :: interval, side, k
        recovered = energy
        if (UNITS == 0 .or. greatest <= 0) return
        recovered = 0
        do interval = 1, 200
            low = energy * (1 - ((201 - interval) / 200.0_dp)**3)
            high = energy * (1 - ((200 - interval) / 200.0_dp)**3)
            do side = -1, 1, 2
                w = 0.5_dp * (low + high + side * place * (high - low))
                total = 0
                do k = 1, size(softening), 3
                    total = total + softening(k) * min(1d12, (greatest / GREATEST_SEEN)**softening(k + 2)) &
                        * tanh(softening(k + 1) * (1 - w / greatest))
                end do
                recovered = recovered + 0.5_dp * (high - low) * exp(-total)
            end do
        end do
    end function recovered
end module NAME_law

! c(6): C, order 11 22 33 12 13 23, C_12 counted once. s(6): second Piola-Kirchhoff stress, Pa. tangent(6, 6): 2 dS/dC, Pa.
! energy: W, J/m3, 0 if the law has none. spread: disagreement of the ensemble, Pa. flags: bit a - 1: component a of C is
! outside the training data; bit a + 5: it never changed there; bit 12: the ensemble disagrees; bit 13: farther from the
! training strains than any of them was from the others.
! status 0; 1: C is not positive definite or not finite; 2: the result is not finite.
recursive subroutine NAME(c, s, tangent, energy, spread, flags, status)
    use NAME_law, only: evaluate, soften, UNITS
    implicit none
    double precision, intent(in) :: c(6)
    double precision, intent(out) :: s(6), tangent(6, 6), energy, spread
    integer, intent(out) :: flags, status
    call evaluate(c, s, tangent, energy, spread, flags, status)
end subroutine NAME

! Finite strain (NLGEOM), solids with NDI = 3. sigma = F S F^T / J; DDSDDE is the tangent of the Jaumann rate of the Kirchhoff
! stress over J (Sun, Chaikof, Levenston 2008, doi 10.1115/1.2979872):
! F_iI F_jJ F_kK F_lL C_IJKL / J + (s_ik d_jl + s_jk d_il + s_il d_jk + s_jl d_ik) / 2.
! PROPS(1): pascals in a unit of stress, for example 1e6 for MPa. STATEV(1): flags, STATEV(2): spread.
! SSE of an energy: W / J, of a unit of the deformed volume; with damage the part that unloading gives back, and SPD the rest.
recursive subroutine umat(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, time, dtime, &
    temp, dtemp, predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, &
    dfgrd0, dfgrd1, noel, npt, layer, kspt, jstep, kinc)
    use NAME_law, only: evaluate, soften, recovered, UNITS, ENERGETIC
    implicit none
    integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, jstep(4), kinc
    double precision :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl, ddsddt(ntens), &
        drplde(ntens), drpldt, stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp, predef(*), dpred(*), &
        props(nprops), coords(3), drot(3, 3), pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3)
    character(len=80) :: cmname
    integer, parameter :: row(6) = [1, 2, 3, 1, 1, 2], column(6) = [1, 2, 3, 2, 3, 3]
    double precision :: f(3, 3), cg(3, 3), c(6), s(6), tangent(6, 6), push(6, 6), cauchy(6), sigma(3, 3)
    double precision :: stiffness(6, 6), jacobian, energy, spread, unit_of_stress, greatest
    integer :: flags, status, a, b, i, j, k, l
    if (ndi /= 3) error stop 'umat: plane stress and other states without three normal stresses are not supported'
    if (UNITS > 0 .and. nstatv < 3) error stop 'umat: this law unloads by a history; it needs *DEPVAR of 3'
    unit_of_stress = 1
    if (nprops >= 1) then
        if (props(1) > 0) unit_of_stress = props(1)
    end if
    f = dfgrd1
    jacobian = f(1, 1) * (f(2, 2) * f(3, 3) - f(2, 3) * f(3, 2)) - f(1, 2) * (f(2, 1) * f(3, 3) - f(2, 3) * f(3, 1)) &
        + f(1, 3) * (f(2, 1) * f(3, 2) - f(2, 2) * f(3, 1))
    cg = matmul(transpose(f), f)
    do a = 1, 6
        c(a) = cg(row(a), column(a))
    end do
    call evaluate(c, s, tangent, energy, spread, flags, status)
    if (nstatv >= 1) statev(1) = flags
    if (nstatv >= 2) statev(2) = spread / unit_of_stress
    if (status /= 0 .or. .not. jacobian > 0) then
        ddsdde = 0
        pnewdt = 0.25d0
        return
    end if
    if (nstatv >= 3) then
        greatest = statev(3)
        call soften(energy, greatest, s, tangent)
        statev(3) = greatest
    end if
    if (ENERGETIC == 1) then
        sse = energy / (jacobian * unit_of_stress)
        if (UNITS > 0) then
            sse = recovered(energy, statev(3)) / (jacobian * unit_of_stress)
            spd = (statev(3) - recovered(statev(3), statev(3))) / (jacobian * unit_of_stress)
        end if
    end if
    do b = 1, 6
        do a = 1, 6
            push(a, b) = f(row(a), row(b)) * f(column(a), column(b))
            if (b > 3) push(a, b) = push(a, b) + f(row(a), column(b)) * f(column(a), row(b))
        end do
    end do
    cauchy = matmul(push, s) / (jacobian * unit_of_stress)
    stiffness = matmul(push, matmul(tangent, transpose(push))) / (jacobian * unit_of_stress)
    do a = 1, 6
        sigma(row(a), column(a)) = cauchy(a)
        sigma(column(a), row(a)) = cauchy(a)
    end do
    do b = 1, ntens
        k = row(b)
        l = column(b)
        do a = 1, ntens
            i = row(a)
            j = column(a)
            if (j == l) stiffness(a, b) = stiffness(a, b) + sigma(i, k) / 2
            if (i == l) stiffness(a, b) = stiffness(a, b) + sigma(j, k) / 2
            if (j == k) stiffness(a, b) = stiffness(a, b) + sigma(i, l) / 2
            if (i == k) stiffness(a, b) = stiffness(a, b) + sigma(j, l) / 2
        end do
    end do
    stress = cauchy(1:ntens)
    ddsdde = stiffness(1:ntens, 1:ntens)
end subroutine umat

! CalculiX, materials whose name begins with USER: Green's strain (tensor shears) in, S and dS/dE out; no *ORIENTATION.
recursive subroutine umat_user(amat, iel, iint, kode, elconloc, emec, emec0, beta, xokl, voj, xkl, vj, ithermal, t1l, dtime, &
    time, ttime, icmd, ielas, mi, nstate_, xstateini, xstate, stre, stiff, iorien, pgauss, orab, pnewdt, ipkon)
    use NAME_law, only: evaluate, soften, UNITS
    implicit none
    character(len=80) :: amat
    integer :: iel, iint, kode, ithermal(*), icmd, ielas, mi(*), nstate_, iorien, ipkon(*)
    double precision :: elconloc(*), emec(6), emec0(6), beta(6), xokl(3, 3), voj, xkl(3, 3), vj, t1l, dtime, time, ttime, &
        xstateini(nstate_, mi(1), *), xstate(nstate_, mi(1), *), stre(6), stiff(21), pgauss(3), orab(7, *), pnewdt
    double precision :: c(6), s(6), tangent(6, 6), energy, spread, unit_of_stress, greatest
    integer :: flags, status, a, b, place
    if (iorien /= 0) error stop 'umat_user: *ORIENTATION is not supported; give the law its axes instead'
    if (UNITS > 0 .and. nstate_ < 3) error stop 'umat_user: this law unloads by a history; it needs *DEPVAR of 3'
    unit_of_stress = 1
    if (-kode - 100 >= 1) then
        if (elconloc(1) > 0) unit_of_stress = elconloc(1)
    end if
    c = 2 * emec
    c(1:3) = c(1:3) + 1
    call evaluate(c, s, tangent, energy, spread, flags, status)
    if (status /= 0) then
        pnewdt = 0.25d0
        return
    end if
    if (nstate_ >= 1) xstate(1, iint, iel) = flags
    if (nstate_ >= 2) xstate(2, iint, iel) = spread / unit_of_stress
    if (nstate_ >= 3) then
        greatest = xstateini(3, iint, iel)
        call soften(energy, greatest, s, tangent)
        xstate(3, iint, iel) = greatest
    end if
    stre = s / unit_of_stress - beta
    if (icmd == 3) return
    place = 0
    do b = 1, 6
        do a = 1, b
            place = place + 1
            stiff(place) = (tangent(a, b) + tangent(b, a)) / (2 * unit_of_stress)
        end do
    end do
end subroutine umat_user
