!> Where in the blank a run failed. Searched for only when it has, so increments cost nothing more.
module failure_location
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use text, only: to_text, place_text
  use knot_vector, only: span_table
  use nurbs_solid, only: nurbs_solid_t
  use block_law, only: block_law_t
  use secondary_surface, only: point_position
  use patch_points, only: determinant, inverse_rows
  use element, only: element_t, next_element, grid_number
  use ranks, only: ranks_t
  use blank, only: blank_t
  use simple_shear, only: sheet_shear, equivalent_strain
  use contact, only: contact_t
  use tool, only: tool_t
  use tool_face, only: face_position
  implicit none
  private

  public :: location_t, location_of_failure, location_of_smallest, most_sheared, &
            most_damaged, location_text
  public :: block_text, find_fastest, find_deepest_point, contact_point_text, position_now

  !> An integration point of an element of a patch.
  type :: location_t
    integer :: part = 0                       !! patch of the blank, 0: no location was found
    integer :: element(3) = 0, point(3) = 0   !! along xi, eta, zeta
    real(wp) :: position(3) = 0.0_wp             !! [length]
    logical :: is_at_start = .false.          !! in the initial shape, for now it is not finite
  end type location_t

contains

  !> The point of the block that failed with NaN or infinite values, or with the most negative
  !! Jacobian. None is found where a law failed for finite values.
  function location_of_failure(blank) result(location)
    type(blank_t), intent(in) :: blank
    type(location_t) :: location
    type(nurbs_solid_t) :: now
    real(wp), allocatable :: stress(:, :, :, :), state(:, :, :, :)
    real(wp) :: j(3, 3), x(3), least, det
    integer, allocatable :: elements(:, :)
    integer :: n, m, q(3), at(3)

    associate (element => blank%parts(blank%report%failed_part)%element)
      now = grid_now(element)
      q = element%rule%n
      call make_room(q, blank%law%n_state, stress, state)
      elements = element%elements_of_block(blank%report%failed_block)
      least = 0.0_wp
      do n = 1, size(elements, 2)
        call element%read_element(elements(:, n), stress, state)
        at = [0, 1, 1]
        do m = 1, product(q)
          call next_element(q, at)
          call element%jacobian(now, elements(:, n), at, j, x)
          det = determinant(j)
          if (all(ieee_is_finite(stress(:, at(1), at(2), at(3)))) .and. &
              all(ieee_is_finite(state(:, at(1), at(2), at(3))))) then
            if (det > least) cycle   ! not for a NaN
          else
            det = -huge(det)
          end if
          if (location%part > 0 .and. .not. det < least) cycle
          location = location_t(blank%report%failed_part, elements(:, n), at)
          if (det < least) least = det
        end do
      end do
      if (location%part > 0) call set_position(element, now, location)
    end associate
  end function location_of_failure

  !> The point whose Jacobian has the largest inverse, which requires the smallest time increment.
  function location_of_smallest(blank) result(location)
    type(blank_t), intent(in) :: blank
    type(location_t) :: location
    type(nurbs_solid_t) :: now
    real(wp) :: j(3, 3), x(3), rate, largest
    integer :: p, n, m, at(3), e(3)

    largest = -1.0_wp
    do p = 1, size(blank%parts)
      associate (element => blank%parts(p)%element)
        now = grid_now(element)
        e = [0, 1, 1]
        do n = 1, product(element%n_elements)
          call next_element(element%n_elements, e)
          if (element%is_outside(e)) cycle
          at = [0, 1, 1]
          do m = 1, product(element%rule%n)
            call next_element(element%rule%n, at)
            call element%jacobian(now, e, at, j, x)
            rate = sum(inverse_rows(j)**2)
            if (.not. rate > largest) cycle
            largest = rate
            location = location_t(p, e, at)
          end do
        end do
        if (location%part == p) call set_position(element, now, location)
      end associate
    end do
  end function location_of_smallest

  !> Room for stress and state of the points of an element.
  pure subroutine make_room(q, n_state, stress, state)
    integer, intent(in) :: q(3), n_state
    real(wp), allocatable, intent(out) :: stress(:, :, :, :), state(:, :, :, :)

    allocate (stress(6, q(1), q(2), q(3)), state(n_state, q(1), q(2), q(3)))
  end subroutine make_room

  !> The point with the largest simple shear, see `sheet_shear`, among the most strained ones of all
  !! elements; none found where none can have sheared by one.
  subroutine most_sheared(blank, location, shear, ranks)
    type(blank_t), intent(in) :: blank
    class(ranks_t), intent(in), optional :: ranks     !! processes that hold the points
    type(location_t), intent(out) :: location
    real(wp), intent(out) :: shear
    type(nurbs_solid_t) :: now
    real(wp), allocatable :: stress(:, :, :, :), state(:, :, :, :)
    real(wp) :: here, start(3, 3), j(3, 3), x(3)
    integer :: p, n, e(3), point(3)

    shear = 0.0_wp
    do p = 1, size(blank%parts)
      associate (element => blank%parts(p)%element)
        now = grid_now(element)
        call make_room(element%rule%n, blank%law%n_state, stress, state)
        e = [0, 1, 1]
        do n = 1, product(element%n_elements)
          call next_element(element%n_elements, e)
          if (element%is_outside(e) .or. .not. element%is_here(e)) cycle
          call element%read_element(e, stress, state)
          point = most_strained(blank%law, stress, state)
          if (point(1) == 0) cycle
          call element%jacobian(element%grid, e, point, start, x)
          call element%jacobian(now, e, point, j, x)
          here = sheet_shear(start, j)
          if (.not. here > shear) cycle
          shear = here
          location = location_t(p, e, point)
        end do
        if (location%part == p) call set_position(element, now, location)
      end associate
    end do
    if (present(ranks)) call take_largest(ranks, blank, shear, location)
  end subroutine most_sheared

  !> The largest value that a process has found, and its location: of equal ones the first one in
  !! the order of the elements.
  subroutine take_largest(ranks, blank, value, location)
    class(ranks_t), intent(in) :: ranks
    type(blank_t), intent(in) :: blank
    real(wp), intent(inout) :: value
    type(location_t), intent(inout) :: location
    integer, parameter :: n = 14
    real(wp) :: own(n), joined(n*ranks%n), found(n, ranks%n)
    integer :: best

    own = [value, 0.0_wp, 0.0_wp, real(location%part, wp), real(location%element, wp), &
           real(location%point, wp), location%position, &
           merge(1.0_wp, 0.0_wp, location%is_at_start)]
    if (location%part > 0) own(2:3) = [real(location%part, wp), real(grid_number(blank%parts( &
      location%part)%element%n_elements, location%element), wp)]
    call ranks%gather(spread(n, 1, ranks%n), own, joined, .true.)
    found = reshape(joined, [n, ranks%n])
    best = minloc(found(3, :), 1, mask=found(1, :) >= maxval(found(1, :)) .and. found(2, :) &
                  <= minval(found(2, :), mask=found(1, :) >= maxval(found(1, :))))
    value = found(1, best)
    location%part = nint(found(4, best))
    location%element = nint(found(5:7, best))
    location%point = nint(found(8:10, best))
    location%position = found(11:13, best)
    location%is_at_start = found(14, best) > 0.5_wp
  end subroutine take_largest

  !> The point with the largest damage indicator of a law that has one; none found without damage.
  subroutine most_damaged(blank, location, damage, ranks)
    type(blank_t), intent(in) :: blank
    class(ranks_t), intent(in), optional :: ranks     !! as above
    type(location_t), intent(out) :: location
    real(wp), intent(out) :: damage
    real(wp), allocatable :: stress(:, :, :, :), state(:, :, :, :)
    integer :: p, n, e(3)

    damage = 0.0_wp
    do p = 1, size(blank%parts)
      associate (element => blank%parts(p)%element)
        call make_room(element%rule%n, blank%law%n_state, stress, state)
        e = [0, 1, 1]
        do n = 1, product(element%n_elements)
          call next_element(element%n_elements, e)
          if (element%is_outside(e) .or. .not. element%is_here(e)) cycle
          call element%read_element(e, stress, state)
          if (.not. maxval(state(blank%law%n_state, :, :, :)) > damage) cycle
          damage = maxval(state(blank%law%n_state, :, :, :))
          location = location_t(p, e, maxloc(state(blank%law%n_state, :, :, :)))
        end do
        if (location%part == p) call set_position(element, grid_now(element), location)
      end associate
    end do
    if (present(ranks)) call take_largest(ranks, blank, damage, location)
  end subroutine most_damaged

  !> The most strained point of an element; zeros where its strain is below that of a simple shear
  !! of one.
  pure function most_strained(law, stress, state) result(point)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: stress(:, :, :, :), state(:, :, :, :)
    integer :: point(3), qa, qb, qc
    real(wp), parameter :: least = 0.5_wp
    real(wp) :: strain, largest

    point = 0
    largest = least
    do qa = 1, size(stress, 2)
      do qb = 1, size(stress, 3)
        do qc = 1, size(stress, 4)
          strain = equivalent_strain(law, stress(:, qa, qb, qc), state(:, qa, qb, qc))
          if (.not. strain > largest) cycle
          largest = strain
          point = [qa, qb, qc]
        end do
      end do
    end do
  end function most_strained

  pure function grid_now(element) result(grid)
    class(element_t), intent(in) :: element
    type(nurbs_solid_t) :: grid

    grid = element%grid
    grid%points = element%motion%x
  end function grid_now

  !> Position of the point now, or at the start if that is not finite.
  pure subroutine set_position(element, now, location)
    class(element_t), intent(in) :: element
    type(nurbs_solid_t), intent(in) :: now
    type(location_t), intent(inout) :: location
    real(wp) :: j(3, 3)

    call element%jacobian(now, location%element, location%point, j, location%position)
    location%is_at_start = .not. all(abs(location%position) < 1.0e100_wp)
    if (location%is_at_start) &
      call element%jacobian(element%grid, location%element, location%point, j, location%position)
  end subroutine set_position

  !> The location as text, such as `element (3, 1, 2), point (1, 1, 2), at (10.5, 0.2, 0)`.
  function location_text(blank, location) result(words)
    type(blank_t), intent(in) :: blank
    type(location_t), intent(in) :: location
    character(:), allocatable :: words

    words = patch_text(blank, location%part)//"element "//triple(location%element)//", point "// &
            triple(location%point)//" along xi, eta, zeta, at "//place_text(location%position)
    if (location%is_at_start) words = words//" in the shape at the start"
  end function location_text

  !> The elements of the block that failed, for a law that failed for finite values.
  function block_text(blank) result(words)
    type(blank_t), intent(in) :: blank
    character(:), allocatable :: words
    integer, allocatable :: elements(:, :)

    associate (report => blank%report)
      elements = blank%parts(report%failed_part)%element%elements_of_block(report%failed_block)
      words = patch_text(blank, report%failed_part)
    end associate
    associate (first => elements(:, 1), last => elements(:, size(elements, 2)))
      words = words//"elements ("//to_text(first(1))//" to "//to_text(last(1))//", "// &
              to_text(first(2))//", "//to_text(first(3))//") along xi, eta, zeta"
    end associate
  end function block_text

  !> The patch of a blank of several, for the beginning of a text.
  function patch_text(blank, part) result(words)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: part
    character(:), allocatable :: words

    words = ""
    if (size(blank%parts) > 1) words = "patch '"//blank%parts(part)%element%name//"', "
  end function patch_text

  pure function triple(counts) result(words)
    integer, intent(in) :: counts(3)
    character(:), allocatable :: words

    words = "("//to_text(counts(1))//", "//to_text(counts(2))//", "//to_text(counts(3))//")"
  end function triple

  !> The fastest control point, in words with its position: where instability shows first.
  subroutine find_fastest(blank, words, position)
    type(blank_t), intent(in) :: blank
    character(:), allocatable, intent(out) :: words
    real(wp), intent(out) :: position(3)      !! [length]
    real(wp), allocatable :: speeds(:, :, :)
    real(wp) :: largest
    integer :: p, i, part, at(3), here(3)

    largest = -1.0_wp
    part = 1
    at = 1
    do p = 1, size(blank%parts)
      speeds = maxval(abs(blank%parts(p)%element%motion%v), 4)
      here = maxloc(speeds)
      if (.not. speeds(here(1), here(2), here(3)) > largest) cycle
      largest = speeds(here(1), here(2), here(3))
      part = p
      at = here
    end do
    associate (body => blank%parts(part)%element)
      position = body%motion%x(at(1), at(2), at(3), :)
      words = patch_text(blank, part)//"control point "//triple(at)//", by element "// &
              triple([(element_of(at(i), i), i=1, 3)])//", at "//place_text(position)
    end associate

  contains

    !> The middle one of the elements that a control point reaches into.
    integer function element_of(control, axis) result(element)
      integer, intent(in) :: control, axis

      associate (kv => blank%parts(part)%element%grid%axes(axis))
        associate (first => span_table(kv) - kv%degree)
          element = (count(first < control - kv%degree) + 1 + count(first <= control))/2
        end associate
      end associate
    end function element_of
  end subroutine find_fastest

  !> The contact point with the largest penetration. Forces do not show it: a spring may be loaded
  !! from a penetration on, and friction adds to it.
  subroutine find_deepest_point(contact, tool, words, position)
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    character(:), allocatable, intent(out) :: words
    real(wp), intent(out), optional :: position(3)   !! [length]
    real(wp) :: depths(contact%secondary%n_points)
    integer :: n

    depths = 0.0_wp
    do n = 1, contact%secondary%n_points
      if (contact%start(n) < 0.0_wp) cycle   ! it does not touch
      depths(n) = norm2(position_now(contact, n) - contact%motion%displacement &
                        - face_position(tool%coefficients, contact%face(n), contact%at(:, n)))
    end do
    n = maxloc(depths, 1)
    words = contact_point_text(contact, tool, n)
    if (present(position)) position = place_now(contact, tool, n)
  end subroutine find_deepest_point

  !> Position of a contact point at the last call, in the frame of a tool that rotates.
  pure function position_now(contact, n) result(x)
    type(contact_t), intent(in) :: contact
    integer, intent(in) :: n                !! number of the point
    real(wp) :: x(3)
    integer :: i, j

    j = (n - 1)/contact%secondary%n_along(1) + 1
    i = n - contact%secondary%n_along(1)*(j - 1)
    x = point_position(contact%secondary, contact%motion%now, i, j)
  end function position_now

  !> A contact point and its position.
  function contact_point_text(contact, tool, n) result(words)
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: n                !! number of the point
    character(:), allocatable :: words
    integer :: i, j

    j = (n - 1)/contact%secondary%n_along(1) + 1
    i = n - contact%secondary%n_along(1)*(j - 1)
    words = "contact point ("//to_text(i)//", "//to_text(j)//"), at "// &
            place_text(place_now(contact, tool, n))
  end function contact_point_text

  !> Position of a contact point at the last call, in space.
  pure function place_now(contact, tool, n) result(x)
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: n                !! number of the point
    real(wp) :: x(3)

    x = position_now(contact, n)
    if (tool%is_turning) x = matmul(tool%rotation, x - tool%displacement) + tool%displacement
  end function place_now

end module failure_location
