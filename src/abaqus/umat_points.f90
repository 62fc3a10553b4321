!> The arguments of a UMAT for some points, in the order of a call: eight points at a time, so that
!! values are read and written in rows.
module umat_points
  use kinds, only: wp
  use point_context, only: point_context_t
  use user_call, only: user_law_t, n_guard, mark
  use plane_stress, only: in_sheet
  implicit none
  private

  public :: set_marks, take_points, return_points, return_point, n_column, at_state

  integer, parameter, public :: n_kept = 9       !! values kept after the state variables
  integer, parameter, public :: n_spare = 24     !! zeros after the state variables, see `slack`
  integer, parameter, public :: n_together = 8   !! points that are taken together
  integer, parameter :: n_gap = 248              ! values after the mark behind STATEV

  !> Where arguments begin in the column of a point. At `at_kept` begins what is kept after the
  !! state variables, the strain already rotated, and the temperature rise by inelastic work. STRESS
  !! and DDSDDE end where their marks begin, at multiples of eight.
  integer, parameter, public :: at_dstrain = 1, at_length = 7, at_rotation = 9, at_place = 18, &
                                at_f0 = 21, at_f1 = 30, at_kept = 39, &
                                at_energies = at_kept + 6, at_heat = at_kept + n_kept, &
                                after_stress = 57, after_tangent = 105
  integer, parameter, public :: n_values = after_tangent + n_guard - 1

  !> The places of the entries 11, 21, 31, 12, ... in a matrix row by row.
  integer, parameter :: columns(9) = [1, 4, 7, 2, 5, 8, 3, 6, 9]

contains

  !> Values of the column of a point that holds STATEV, zeros and a mark. Those after the mark are
  !! nobody's: a single write far beyond STATEV is not to change another point.
  pure integer function n_column(n_statv)
    integer, intent(in) :: n_statv

    n_column = at_state(n_statv) - 1 + n_statv + n_spare + n_guard + n_gap
  end function n_column

  !> Where STATEV begins there, to end at a multiple of eight.
  pure integer function at_state(n_statv)
    integer, intent(in) :: n_statv

    at_state = modulo(-n_statv, 8) + 1
  end function at_state

  !> The marks after arguments, and zeros after STATEV. A call leaves them as they are, or it ends
  !! the run.
  pure subroutine set_marks(n_statv, m, values, statev)
    integer, intent(in) :: n_statv, m              !! of the law, points
    real(wp), intent(inout) :: values(n_values, m), statev(n_column(n_statv), m)
    integer :: i, c

    do i = 1, m
      !$omp simd
      do c = 0, n_guard - 1
        values(after_stress + c, i) = mark
        values(after_tangent + c, i) = mark
      end do
      associate (last => n_column(n_statv) - n_gap)
        !$omp simd
        do c = 1, n_spare
          statev(last - n_guard - n_spare + c, i) = 0.0_wp
        end do
        !$omp simd
        do c = 1, n_guard
          statev(last - n_guard + c, i) = mark
        end do
      end associate
    end do
  end subroutine set_marks

  !> The arguments of `m` points from the one with number `first`.
  pure subroutine take_points(law, context, first, m, dstrain, strain, rotation, stress, state, &
                              values, statev)
    class(user_law_t), intent(in) :: law
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: first, m
    real(wp), intent(in), dimension(context%n, 6) :: dstrain, strain, stress
    real(wp), intent(in) :: rotation(context%n, 9), state(context%n, law%n_state)
    real(wp), intent(inout) :: values(n_values, m), statev(n_column(law%n_statv), m)
    integer :: i, c, l

    if (m == n_together .and. .not. law%is_plane) then
      call take_eight(law, context, first, dstrain, strain, rotation, stress, state, values, statev)
      return
    end if
    do i = 1, m
      l = first + i - 1
      values(at_length, i) = context%length(l)
      values(at_rotation:at_rotation + 8, i) = rotation(l, :)
      values(at_place:at_place + 2, i) = context%place(l, :)
      if (law%needs_gradients) then
        values(at_f0:at_f0 + 8, i) = context%f0(l, columns)
        values(at_f1:at_f1 + 8, i) = context%f1(l, columns)
      end if
      associate (kept => law%n_before, at => at_state(law%n_statv))
        values(at_energies:at_energies + 2, i) = state(l, kept + 7:kept + 9)
        if (law%heat_state > 0) values(at_heat, i) = state(l, law%heat_state)
        do c = 1, law%n_statv
          statev(at + c - 1, i) = state(l, c)
        end do
      end associate
      if (law%is_plane) then
        values(at_dstrain:at_dstrain + 2, i) = dstrain(l, in_sheet)
        values(at_kept:at_kept + 2, i) = strain(l, in_sheet)
        values(after_stress - 3:after_stress - 1, i) = stress(l, in_sheet)
      else
        values(at_dstrain:at_dstrain + 5, i) = dstrain(l, :)
        values(at_kept:at_kept + 5, i) = strain(l, :)
        values(after_stress - 6:after_stress - 1, i) = stress(l, :)
      end if
    end do
  end subroutine take_points

  !> Eight points of a law of solids.
  pure subroutine take_eight(law, context, first, dstrain, strain, rotation, stress, state, &
                             values, statev)
    class(user_law_t), intent(in) :: law
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: first
    real(wp), intent(in), dimension(context%n, 6) :: dstrain, strain, stress
    real(wp), intent(in) :: rotation(context%n, 9), state(context%n, law%n_state)
    real(wp), intent(inout) :: values(n_values, *), statev(n_column(law%n_statv), *)
    integer :: c, i

    associate (n => context%n, kept => law%n_before, at => at_state(law%n_statv))
      call take_six(n, dstrain(first, 1), values(at_dstrain, 1))
      call take_six(n, strain(first, 1), values(at_kept, 1))
      call take_six(n, stress(first, 1), values(after_stress - 6, 1))
      call take_one(context%length(first), values(at_length, 1))
      call take_four(n, rotation(first, 1), values(at_rotation, 1))
      call take_four(n, rotation(first, 5), values(at_rotation + 4, 1))
      call take_one(rotation(first, 9), values(at_rotation + 8, 1))
      call take_two(n, context%place(first, 1), values(at_place, 1))
      call take_one(context%place(first, 3), values(at_place + 2, 1))
      if (law%needs_gradients) then
        call take_matrix(n, context%f0(first, 1), values(at_f0, 1))
        call take_matrix(n, context%f1(first, 1), values(at_f1, 1))
      end if
      call take_two(n, state(first, kept + 7), values(at_energies, 1))
      call take_one(state(first, kept + 9), values(at_energies + 2, 1))
      if (law%heat_state > 0) call take_one(state(first, law%heat_state), values(at_heat, 1))
      do c = 1, law%n_statv
        do i = 1, 8
          statev(at + c - 1, i) = state(first + i - 1, c)
        end do
      end do
    end associate
  end subroutine take_eight

  !> Four values of eight points: together, for a store takes as long for one as for four.
  pure subroutine take_four(n, rows, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: rows(n, *)
    real(wp), intent(inout) :: values(n_values, *)
    integer :: i

    !GCC$ unroll 8
    do i = 1, 8
      values(1, i) = rows(i, 1)
      values(2, i) = rows(i, 2)
      values(3, i) = rows(i, 3)
      values(4, i) = rows(i, 4)
    end do
  end subroutine take_four

  pure subroutine take_two(n, rows, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: rows(n, *)
    real(wp), intent(inout) :: values(n_values, *)
    integer :: i

    !GCC$ unroll 8
    do i = 1, 8
      values(1, i) = rows(i, 1)
      values(2, i) = rows(i, 2)
    end do
  end subroutine take_two

  pure subroutine take_one(row, values)
    real(wp), intent(in) :: row(8)
    real(wp), intent(inout) :: values(n_values, *)
    integer :: i

    !GCC$ unroll 8
    do i = 1, 8
      values(1, i) = row(i)
    end do
  end subroutine take_one

  pure subroutine take_six(n, rows, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: rows(n, *)
    real(wp), intent(inout) :: values(n_values, *)

    call take_four(n, rows, values)
    call take_two(n, rows(1, 5), values(5, 1))
  end subroutine take_six

  !> Matrices of eight points, from row by row to column by column.
  pure subroutine take_matrix(n, rows, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: rows(n, *)
    real(wp), intent(inout) :: values(n_values, *)
    integer :: i

    !GCC$ unroll 8
    do i = 1, 8
      values(1, i) = rows(i, 1)
      values(2, i) = rows(i, 4)
      values(3, i) = rows(i, 7)
      values(4, i) = rows(i, 2)
    end do
    !GCC$ unroll 8
    do i = 1, 8
      values(5, i) = rows(i, 5)
      values(6, i) = rows(i, 8)
      values(7, i) = rows(i, 3)
      values(8, i) = rows(i, 6)
      values(9, i) = rows(i, 9)
    end do
  end subroutine take_matrix

  !> What the calls for eight points of a law of solids returned, all of them in one increment; if
  !! it is finite.
  pure subroutine return_points(law, n, first, dstrain, strain, values, statev, stress, state, ok)
    class(user_law_t), intent(in) :: law
    integer, intent(in) :: n, first
    real(wp), intent(in), dimension(n, 6) :: dstrain, strain
    real(wp), intent(in) :: values(n_values, *), statev(n_column(law%n_statv), *)
    real(wp), intent(inout) :: stress(n, 6), state(n, law%n_state)
    logical, intent(out) :: ok
    real(wp) :: total(6), rest
    integer :: c, i

    associate (kept => law%n_before, at => at_state(law%n_statv))
      total = 0.0_wp
      rest = 0.0_wp
      do i = 1, 8
        total = total + abs(values(after_stress - 6:after_stress - 1, i))
        do c = 0, law%n_statv - 1
          rest = rest + abs(statev(at + c, i))
        end do
      end do
      ! Of a finite sum all parts are finite.
      ok = sum(total) + rest <= huge(1.0_wp)
      if (.not. ok) return
      call put_rows(n, 6, values(after_stress - 6, 1), stress(first, 1))
      do c = 1, law%n_statv
        do i = 1, 8
          state(first + i - 1, c) = statev(at + c - 1, i)
        end do
      end do
      do c = 1, 6
        !$omp simd
        do i = first, first + 7
          state(i, kept + c) = strain(i, c) + dstrain(i, c)
        end do
      end do
      call put_rows(n, 3, values(at_energies, 1), state(first, kept + 7))
      if (law%heat_state > 0) call put_rows(n, 1, values(at_heat, 1), state(first, law%heat_state))
    end associate
  end subroutine return_points

  !> The first `m` values of each of eight points, into rows.
  pure subroutine put_rows(n, m, values, rows)
    integer, intent(in) :: n, m
    real(wp), intent(in) :: values(n_values, 8)
    real(wp), intent(inout) :: rows(n, m)
    integer :: c

    do c = 1, m
      rows(:8, c) = values(c, :)
    end do
  end subroutine put_rows

  !> What a call returned for point `l`; its strain as it is among the values.
  pure subroutine return_point(law, n, l, values, statev, stress, state)
    class(user_law_t), intent(in) :: law
    integer, intent(in) :: n, l
    real(wp), intent(in) :: values(n_values), statev(n_column(law%n_statv))
    real(wp), intent(inout) :: stress(n, 6), state(n, law%n_state)

    if (law%is_plane) then
      stress(l, in_sheet) = values(after_stress - 3:after_stress - 1)
    else
      stress(l, :) = values(after_stress - 6:after_stress - 1)
    end if
    associate (m => law%n_statv, kept => law%n_before, at => at_state(law%n_statv))
      state(l, :m) = statev(at:at + m - 1)
      state(l, kept + 1:kept + n_kept) = values(at_kept:at_kept + n_kept - 1)
    end associate
    if (law%heat_state > 0) state(l, law%heat_state) = values(at_heat)
  end subroutine return_point

end module umat_points
