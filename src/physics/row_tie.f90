!> Control points that move alike in one component. On a plane of symmetry the row of control points
!! next to the edge of a shell moves along the plane as the edge does: its slope across is none.
module row_tie
  use kinds, only: wp
  use state_store, only: state_store_t
  use element, only: element_t, part_t
  use blank, only: assembly_t, blank_t
  use effect, only: effect_t, instant_t
  implicit none
  private

  public :: even_out, leave_cut_groups

  !> Groups of control points, one after the other; each takes the velocity of its momentum.
  type, extends(effect_t), public :: row_tie_t
    integer :: component = 1
    integer, allocatable :: last(:)             !! last point of each group, shape (n_groups)
    integer, allocatable :: part(:)             !! patch of each point, shape (n)
    integer, allocatable :: points(:, :)        !! control indices, shape (3, n)
  contains
    procedure :: apply
    procedure :: carry => carry_tie
    procedure :: is_by_rows
    procedure :: widen_shares
  end type row_tie_t

contains

  subroutine apply(self, bodies, instant)
    class(row_tie_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant

    if (instant%dt_mean > 0.0_wp) call even_out(self, bodies%blank)
  end subroutine apply

  !> The rows of a group are moved by the same processes.
  pure logical function is_by_rows(self)
    class(row_tie_t), intent(in) :: self

    is_by_rows = .true.
  end function is_by_rows

  !> Who moves a row of a group moves all of them.
  pure subroutine widen_shares(self, moved_by)
    class(row_tie_t), intent(in) :: self
    integer, intent(inout) :: moved_by(:, :)
    integer :: first, g, r, low, high

    first = 1
    do g = 1, size(self%last)
      low = minval(self%points(2, first:self%last(g)))
      high = maxval(self%points(2, first:self%last(g)))
      do r = 1, size(moved_by, 2)
        if (max(low, moved_by(1, r)) > min(high, moved_by(2, r))) cycle
        moved_by(1, r) = min(low, moved_by(1, r))
        moved_by(2, r) = max(high, moved_by(2, r))
      end do
      first = self%last(g) + 1
    end do
  end subroutine widen_shares

  !> One velocity for each group, of the same momentum. Points at seams weigh with all that moves
  !! with them, so that each patch comes to the same. Groups in rows that do not move here are left
  !! out.
  pure subroutine even_out(tie, blank)
    class(row_tie_t), intent(in) :: tie
    type(blank_t), intent(inout) :: blank
    real(wp) :: mass, momentum
    integer :: next, first, g, p

    next = 1
    do g = 1, size(tie%last)
      first = next
      next = tie%last(g) + 1
      associate (rows => blank%parts(tie%part(first))%element%motion%rows, &
                 j => tie%points(2, first))
        if (j < rows%first .or. j > rows%last) cycle
      end associate
      mass = 0.0_wp
      momentum = 0.0_wp
      do p = first, tie%last(g)
        associate (at => tie%points(:, p), body => blank%parts(tie%part(p))%element)
          if (is_led(body, at)) cycle
          mass = mass + body%inertia(at(1), at(2), at(3))
          momentum = momentum + body%inertia(at(1), at(2), at(3)) &
                     *body%motion%v(at(1), at(2), at(3), tie%component)
        end associate
      end do
      do p = first, tie%last(g)
        associate (at => tie%points(:, p))
          if (is_led(blank%parts(tie%part(p))%element, at)) cycle
          blank%parts(tie%part(p))%element%motion%v(at(1), at(2), at(3), tie%component) = &
            momentum/mass
        end associate
      end do
    end do
  end subroutine even_out

  !> Take control points out of their groups that an outline has cut away or that follow others at
  !! it. A group of one is none.
  subroutine leave_cut_groups(tie, parts)
    type(row_tie_t), intent(inout) :: tie
    type(part_t), intent(in) :: parts(:)
    logical :: stays(size(tie%part))
    integer :: last(size(tie%last))
    integer :: first, g, p

    stays = [(.not. is_led(parts(tie%part(p))%element, tie%points(:, p)), p=1, size(stays))]
    first = 1
    do g = 1, size(last)
      if (count(stays(first:tie%last(g))) < 2) stays(first:tie%last(g)) = .false.
      last(g) = count(stays(:tie%last(g)))
      first = tie%last(g) + 1
    end do
    tie%part = pack(tie%part, stays)
    tie%points = reshape(pack(tie%points, spread(stays, 1, 3)), [3, count(stays)])
    tie%last = distinct(last)
  end subroutine leave_cut_groups

  !> The numbers above zero of a list that never falls, each once.
  pure function distinct(list) result(each)
    integer, intent(in) :: list(:)
    integer, allocatable :: each(:)
    integer :: i

    each = pack(list, [(list(i) > 0 .and. all(list(:i - 1) < list(i)), i=1, size(list))])
  end function distinct

  !> Does a control point follow others at the edge of an outline, or lie outside? It is none of the
  !! group then.
  pure logical function is_led(body, at)
    class(element_t), intent(in) :: body
    integer, intent(in) :: at(3)

    is_led = .false.
    if (allocated(body%ties%is_free)) is_led = .not. body%ties%is_free(at(1), at(2))
  end function is_led

  !> All follows from the motion.
  subroutine carry_tie(self, store)
    class(row_tie_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store
  end subroutine carry_tie

end module row_tie
