!> Rows of control points among the processes of a run: whether each moves but some of them, which,
!! and all of them again where somebody must look at them.
module row_sharing
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use row_shares, only: share_rows, move_own_rows, know_all_rows, gather_rows
  use contact_effect, only: contact_view_t, contact_pairs
  use contact_sharing, only: last_rows, add_row_costs
  use model, only: model_t
  use run_state, only: run_t
  implicit none
  private

  public :: share_own_rows, join_rows, know_rows, costs_of_rows, look_at_shares

  real(wp), parameter :: uneven = 1.05_wp      ! work of the busiest process over the mean
  integer, parameter :: first_look = 64        ! increments before that is looked at

contains

  !> From here on each process moves the rows that its elements and contact points need, if nothing
  !! in the step needs more. Where rows may not change hands, those that it has moved before.
  subroutine share_own_rows(model, run, may_move)
    type(model_t), intent(inout), target :: model      !! with processes that share the tiles
    type(run_t), intent(inout) :: run
    logical, intent(in) :: may_move
    type(contact_view_t), allocatable :: pairs(:)
    integer, allocatable :: last_of(:), moved_by(:, :), n_reported(:), before(:, :)
    integer :: i

    associate (element => model%bodies%blank%parts(1)%element)
      if (.not. may_move) then
        if (allocated(element%motion%rows%last_of)) call move_own_rows(element%motion%rows)
        return
      end if
      ! Soon at first, and not too often where no shares are even.
      run%look_at_shares = run%n_steps &
                           + max(int(first_look, int64), run%n_steps - run%shared_at)
      if (run%share_every > 0) run%look_at_shares = run%n_steps + run%share_every
      run%shared_at = run%n_steps
      if (allocated(element%motion%rows%last_of)) deallocate (element%motion%rows%last_of)
      if (.not. is_by_rows(model)) return
      call element%rows_of_processes(last_of, moved_by, n_reported)
      if (.not. allocated(last_of)) return
      pairs = contact_pairs(model%forces)
      do i = 1, size(pairs)
        moved_by(2, :) = max(moved_by(2, :), last_rows(pairs(i)%pair%pair, last_of))
      end do
      do
        before = moved_by
        do i = 1, size(model%supports)
          call model%supports(i)%item%widen_shares(moved_by)
        end do
        if (all(moved_by == before)) exit
      end do
      call share_rows(element%motion%rows, model%ranks, last_of, moved_by, element%reach)
      element%motion%rows%n_reported = n_reported
    end associate
  end subroutine share_own_rows

  !> Is the sheet one patch without a seam or an outline, and can all that acts on it do with some
  !! of the rows?
  pure logical function is_by_rows(model)
    type(model_t), intent(in) :: model
    integer :: i

    associate (blank => model%bodies%blank)
      is_by_rows = size(blank%parts) == 1 .and. .not. blank%law%is_serial &
                   .and. blank%seams%n_groups == 0 &
                   .and. .not. allocated(blank%parts(1)%element%regions) &
                   .and. all([(.not. any(model%motions(i)%terms%is_rotation), &
                               i=1, size(model%motions))]) &
                   .and. .not. any(model%bodies%tools%is_turning)
    end associate
    do i = 1, size(model%forces)
      is_by_rows = is_by_rows .and. model%forces(i)%item%is_by_rows()
    end do
    do i = 1, size(model%supports)
      is_by_rows = is_by_rows .and. model%supports(i)%item%is_by_rows()
    end do
  end function is_by_rows

  !> Positions, velocities and forces of all rows at all processes, which go on moving their own.
  subroutine join_rows(model, run)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    integer :: i, n(3)

    associate (element => model%bodies%blank%parts(1)%element)
      if (.not. element%motion%rows%is_shared) return
      n = shape(element%mass)
      n(3) = 3*n(3)
      associate (motion => element%motion)
        call gather_rows(motion%rows, n, motion%x)
        call gather_rows(motion%rows, n, motion%v)
        call gather_rows(motion%rows, n, motion%internal_force)
        call gather_rows(motion%rows, n, motion%external_force)
        call gather_rows(motion%rows, n, run%v_before(1)%values)
      end associate
      call element%join_rows()
    end associate
    do i = 1, size(model%forces)
      call model%forces(i)%item%join_rows(model%bodies)
    end do
    do i = 1, size(model%supports)
      call model%supports(i)%item%join_rows(model%bodies)
    end do
  end subroutine join_rows

  !> All rows are known, and each process moves them until they are shared again.
  subroutine know_rows(model, run)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run

    call join_rows(model, run)
    call know_all_rows(model%bodies%blank%parts(1)%element%motion%rows)
  end subroutine know_rows

  !> Time that contact took here, at the rows of control points with which its tiles begin. Where
  !! each process moves all rows, contact is shared by itself: none.
  function costs_of_rows(model) result(costs)
    type(model_t), intent(in), target :: model
    real(wp), allocatable :: costs(:)              !! [clock ticks]
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    allocate (costs(size(model%bodies%blank%parts(1)%element%mass, 2)), source=0.0_wp)
    pairs = contact_pairs(model%forces)
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair%pair)
        if (allocated(pair%rows%last_of)) call add_row_costs(pair, costs)
      end associate
    end do
  end function costs_of_rows

  !> Look whether work may change hands: at the end of a step of the deck, and where the processes
  !! have uneven shares of it: on request, or after ever more increments where each moves but some
  !! rows. All processes call it.
  subroutine look_at_shares(model, run, is_end, may_move)
    type(model_t), intent(in), target :: model
    type(run_t), intent(inout) :: run
    logical, intent(in) :: is_end
    logical, intent(out) :: may_move
    real(wp), allocatable :: works(:), costs(:)
    real(wp) :: own(1)
    integer :: p

    may_move = is_end
    if (may_move .or. .not. allocated(model%ranks) .or. model%step%is_static) return
    if (run%n_steps < run%look_at_shares) return
    associate (parts => model%bodies%blank%parts)
      if (.not. (parts(1)%element%motion%rows%is_shared .or. run%share_every > 0)) return
      run%look_at_shares = run%shared_at + 2*(run%look_at_shares - run%shared_at)
      if (run%share_every > 0) run%look_at_shares = run%n_steps + run%share_every
      costs = costs_of_rows(model)
      own = 0.0_wp
      do p = 1, size(parts)
        own = own + sum(parts(p)%element%tile_costs(costs(:merge(size(costs), 0, p == 1))))
      end do
    end associate
    allocate (works(model%ranks%n))
    call model%ranks%gather(spread(1, 1, model%ranks%n), own, works, .true.)
    may_move = maxval(works)*size(works) > uneven*sum(works)
  end subroutine look_at_shares

end module row_sharing
