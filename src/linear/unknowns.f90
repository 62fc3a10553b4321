!> From displacement components of control points to the unknowns of a system of equations: a
!! component is an unknown itself, is held, or follows others, as at seams and planes of symmetry.
!!
!! Components are numbered by control point, three to each: component c of point p is 3*(p - 1) + c,
!! and the points of all patches follow each other. With u the unknowns, the displacements are
!! d = T u, plus what is prescribed; forces f on the components become T' f.
module unknowns
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  implicit none
  private

  public :: new_unknowns, to_components, to_unknowns

  !> A component that follows others: the sum of these times the coefficients.
  type, public :: tie_t
    integer :: component = 0
    integer, allocatable :: leaders(:)             !! components, free, held or tied themselves
    real(wp), allocatable :: coefficients(:)
  end type tie_t

  !> The rows of T in a compressed list; that of a held component is empty.
  type, public :: unknowns_t
    integer :: n_components = 0
    integer :: n_free = 0                          !! unknowns
    integer, allocatable :: first(:)               !! row c: first(c) to first(c + 1) - 1
    integer, allocatable :: unknown(:)             !! rising within a row
    real(wp), allocatable :: coefficient(:)
  end type unknowns_t

  !> Columns and values of a row of T while ties are resolved.
  type :: row_t
    integer, allocatable :: unknown(:)
    real(wp), allocatable :: coefficient(:)
  end type row_t

  integer, parameter :: is_free = 0, is_held = -1   ! a component that is tied: number of its tie

contains

  !> Number the components that neither are held nor follow others, in their order, and express the
  !! others by them. A component that is held holds the one that it alone follows, with what else
  !! follows that. Fails where ties go round in a circle, where a component is tied twice, or where
  !! one is held that several lead.
  pure subroutine new_unknowns(held, ties, map, error)
    logical, intent(in) :: held(:)                 !! of each component
    type(tie_t), intent(in) :: ties(:)
    type(unknowns_t), intent(out) :: map
    type(error_t), allocatable, intent(out) :: error
    integer :: state(size(held)), number(size(held)), c

    state = merge(is_held, is_free, held)
    call pass_on_holds(ties, state, error)
    if (allocated(error)) return
    number = 0
    do c = 1, size(held)
      if (state(c) /= is_free) cycle
      map%n_free = map%n_free + 1
      number(c) = map%n_free
    end do
    map%n_components = size(held)
    call fill_rows(ties, state, number, map, error)
  end subroutine new_unknowns

  !> Enter the ties into the states, and hold what leads a held component.
  pure subroutine pass_on_holds(ties, state, error)
    type(tie_t), intent(in) :: ties(:)
    integer, intent(inout) :: state(:)             !! of each component
    type(error_t), allocatable, intent(out) :: error
    integer :: tie_of(size(state)), t
    logical :: has_changed

    tie_of = 0
    do t = 1, size(ties)
      if (tie_of(ties(t)%component) /= 0) then
        call fail(error, component_name(ties(t)%component)//" is tied twice")
        return
      end if
      tie_of(ties(t)%component) = t
    end do
    has_changed = .true.
    do while (has_changed)
      has_changed = .false.
      do t = 1, size(ties)
        if (state(ties(t)%component) /= is_held) cycle
        if (all(state(ties(t)%leaders) == is_held)) cycle
        if (size(ties(t)%leaders) > 1) then
          call fail(error, component_name(ties(t)%component)//" is held, but follows several "// &
                    "others")
          return
        end if
        state(ties(t)%leaders) = is_held
        has_changed = .true.
      end do
    end do
    do t = 1, size(ties)
      if (state(ties(t)%component) == is_free) state(ties(t)%component) = t
    end do
  end subroutine pass_on_holds

  !> Rows of T: those of ties by substitution, until all that leads a tie is known.
  pure subroutine fill_rows(ties, state, number, map, error)
    type(tie_t), intent(in) :: ties(:)
    integer, intent(in) :: state(:), number(:)     !! of each component
    type(unknowns_t), intent(inout) :: map
    type(error_t), allocatable, intent(out) :: error
    type(row_t) :: rows(size(ties))
    integer :: t, c, n, n_left, n_before

    n_left = count(state > 0)
    do while (n_left > 0)
      n_before = n_left
      do t = 1, size(ties)
        if (state(ties(t)%component) /= t .or. allocated(rows(t)%unknown)) cycle
        if (.not. all_known(ties(t)%leaders, state, rows)) cycle
        call substitute(ties(t), state, number, rows, rows(t))
        n_left = n_left - 1
      end do
      if (n_left < n_before) cycle
      do t = 1, size(ties)
        if (state(ties(t)%component) == t .and. .not. allocated(rows(t)%unknown)) exit
      end do
      call fail(error, component_name(ties(t)%component)//" follows itself")
      return
    end do
    allocate (map%first(size(state) + 1))
    map%first(1) = 1
    do c = 1, size(state)
      n = merge(1, 0, state(c) == is_free)
      if (state(c) > 0) n = size(rows(state(c))%unknown)
      map%first(c + 1) = map%first(c) + n
    end do
    allocate (map%unknown(map%first(size(state) + 1) - 1))
    allocate (map%coefficient(size(map%unknown)), source=1.0_wp)
    do c = 1, size(state)
      associate (first => map%first(c), last => map%first(c + 1) - 1)
        if (state(c) == is_free) map%unknown(first) = number(c)
        if (state(c) > 0) then
          map%unknown(first:last) = rows(state(c))%unknown
          map%coefficient(first:last) = rows(state(c))%coefficient
        end if
      end associate
    end do
  end subroutine fill_rows

  pure logical function all_known(components, state, rows)
    integer, intent(in) :: components(:), state(:)
    type(row_t), intent(in) :: rows(:)
    integer :: i

    all_known = .true.
    do i = 1, size(components)
      if (state(components(i)) > 0) &
        all_known = all_known .and. allocated(rows(state(components(i)))%unknown)
    end do
  end function all_known

  !> The row of a tie whose leaders are known.
  pure subroutine substitute(tie, state, number, rows, row)
    type(tie_t), intent(in) :: tie
    integer, intent(in) :: state(:), number(:)
    type(row_t), intent(in) :: rows(:)
    type(row_t), intent(inout) :: row
    type(row_t) :: sum
    integer :: i, k

    allocate (sum%unknown(0), sum%coefficient(0))
    do i = 1, size(tie%leaders)
      associate (c => tie%leaders(i), factor => tie%coefficients(i))
        if (state(c) == is_free) call add_term(sum, number(c), factor)
        if (state(c) > 0) then
          do k = 1, size(rows(state(c))%unknown)
            call add_term(sum, rows(state(c))%unknown(k), factor*rows(state(c))%coefficient(k))
          end do
        end if
      end associate
    end do
    call move_alloc(sum%unknown, row%unknown)
    call move_alloc(sum%coefficient, row%coefficient)
  end subroutine substitute

  !> Add to a coefficient, or put it in its place in the order.
  pure subroutine add_term(row, unknown, coefficient)
    type(row_t), intent(inout) :: row
    integer, intent(in) :: unknown
    real(wp), intent(in) :: coefficient
    integer :: at

    at = count(row%unknown < unknown) + 1
    if (any(row%unknown == unknown)) then
      row%coefficient(at) = row%coefficient(at) + coefficient
    else
      row%unknown = [row%unknown(:at - 1), unknown, row%unknown(at:)]
      row%coefficient = [row%coefficient(:at - 1), coefficient, row%coefficient(at:)]
    end if
  end subroutine add_term

  pure function component_name(component) result(name)
    integer, intent(in) :: component
    character(:), allocatable :: name

    name = "component "//to_text(mod(component - 1, 3) + 1)//" of control point "// &
           to_text((component - 1)/3 + 1)
  end function component_name

  !> Displacements of all components from the unknowns, those of held ones 0.
  pure function to_components(map, u) result(d)
    type(unknowns_t), intent(in) :: map
    real(wp), intent(in) :: u(:)
    real(wp) :: d(map%n_components)
    integer :: c

    do c = 1, map%n_components
      associate (first => map%first(c), last => map%first(c + 1) - 1)
        d(c) = sum(map%coefficient(first:last)*u(map%unknown(first:last)))
      end associate
    end do
  end function to_components

  !> Forces on the unknowns from those on all components, added in the order of the components.
  pure function to_unknowns(map, f) result(q)
    type(unknowns_t), intent(in) :: map
    real(wp), intent(in) :: f(:)
    real(wp) :: q(map%n_free)
    integer :: c, k

    q = 0.0_wp
    do c = 1, map%n_components
      do k = map%first(c), map%first(c + 1) - 1
        q(map%unknown(k)) = q(map%unknown(k)) + map%coefficient(k)*f(c)
      end do
    end do
  end function to_unknowns

end module unknowns
