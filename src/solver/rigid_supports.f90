!> Rigid motions of bodies that their supports leave, and the fewest components of control points
!! that hold them. Patches without a common seam are bodies of their own, as are the pieces that a
!! trim leaves.
module rigid_supports
  use kinds, only: wp
  use text, only: place_text, axis_names
  use linear_algebra, only: rigid_row
  use knot_vector, only: span_table
  use patch_seams, only: seams_t
  use element, only: part_t, element_t
  use body_parts, only: field_t, vector_at
  use vibration, only: fixed_t
  implicit none
  private

  public :: hold_rigid_motions, held_words, find_unheld, motions_along

  !> What constraints have taken from the six rigid motions: an orthonormal basis.
  type :: taken_t
    integer :: n = 0
    real(wp) :: basis(6, 6) = 0.0_wp
  end type taken_t

  !> Number of the body of each control point of a part, 0 for those without motion of their own.
  type :: body_of_t
    integer, allocatable :: number(:, :)
  end type body_of_t

  real(wp), parameter :: least = 1.0e-6_wp         !! of a motion that counts as held

contains

  !> Hold what is free, each time the component that the rigid motions left move most: points well
  !! apart.
  subroutine hold_rigid_motions(parts, seams, at, fixed, added)
    type(part_t), intent(in) :: parts(:)
    type(seams_t), intent(in) :: seams
    type(field_t), intent(in) :: at(:)               !! positions of the control points, by part
    type(fixed_t), intent(inout) :: fixed(:)
    integer, allocatable, intent(out) :: added(:, :) !! part, place in the field as one list; (2, n)
    type(body_of_t) :: bodies(size(parts))
    real(wp) :: centre(3), length
    integer :: k, n

    call find_extent(at, centre, length)
    call find_bodies(parts, seams, bodies, n)
    allocate (added(2, 0))
    do k = 1, n
      call hold_body(at, bodies, k, centre, length, fixed, added)
    end do
  end subroutine hold_rigid_motions

  !> The same of one body.
  subroutine hold_body(at, bodies, k, centre, length, fixed, added)
    type(field_t), intent(in) :: at(:)
    type(body_of_t), intent(in) :: bodies(:)
    integer, intent(in) :: k
    real(wp), intent(in) :: centre(3), length        !! of all bodies
    type(fixed_t), intent(inout) :: fixed(:)
    integer, allocatable, intent(inout) :: added(:, :)
    type(taken_t) :: taken
    real(wp) :: rest(6), largest
    integer :: p, i, best(2)

    taken = taken_by_supports(at, bodies, k, centre, length, fixed)
    do while (taken%n < 6)
      largest = 0.0_wp
      best = 0
      do p = 1, size(at)
        do i = 1, size(fixed(p)%is_fixed)
          if (.not. (is_leader(fixed(p), i) .and. is_in_body(bodies(p), i, k))) cycle
          rest = remainder(taken, row_of(at(p), i, centre, length))
          if (norm2(rest) <= largest*(1.0_wp + 1.0e-9_wp)) cycle
          largest = norm2(rest)
          best = [p, i]
        end do
      end do
      if (largest <= least) exit   ! all on one line
      call hold(best(2), shape(fixed(best(1))%is_fixed), fixed(best(1))%is_fixed)
      call take(taken, row_of(at(best(1)), best(2), centre, length))
      added = reshape([added, best], [2, size(added, 2) + 1])
    end do
  end subroutine hold_body

  !> What the supports of a body hold of its rigid motions.
  pure function taken_by_supports(at, bodies, k, centre, length, fixed) result(taken)
    type(field_t), intent(in) :: at(:)
    type(body_of_t), intent(in) :: bodies(:)
    integer, intent(in) :: k
    real(wp), intent(in) :: centre(3), length
    type(fixed_t), intent(in) :: fixed(:)
    type(taken_t) :: taken
    logical, allocatable :: held(:)
    integer :: p, i

    do p = 1, size(at)
      held = reshape(fixed(p)%is_fixed, [size(fixed(p)%is_fixed)])
      do i = 1, size(held)
        if (taken%n == 6) return
        if (.not. is_in_body(bodies(p), i, k)) cycle
        if (held(i)) call take(taken, row_of(at(p), i, centre, length))
        if (is_leader(fixed(p), i)) cycle
        call take(taken, row_of(at(p), i, centre, length) &
                         - row_of(at(p), fixed(p)%leader(i), centre, length))
      end do
    end do
  end function taken_by_supports

  !> The resultant of forces that no support of a body can bear: its part along the rigid motions
  !! that the supports leave, of the body where it is the largest part of all forces there.
  subroutine find_unheld(parts, seams, at, fixed, forces, unheld, total)
    type(part_t), intent(in) :: parts(:)
    type(seams_t), intent(in) :: seams
    type(field_t), intent(in) :: at(:), forces(:)    !! by part
    type(fixed_t), intent(in) :: fixed(:)            !! supports
    real(wp), intent(out) :: unheld(6)               !! forces, moments over the size [force]
    real(wp), intent(out) :: total                   !! sum of all amounts [force]
    type(body_of_t) :: bodies(size(parts))
    real(wp), allocatable :: list(:)
    real(wp) :: centre(3), length, resultant(6), amount
    integer :: p, i, k, n

    call find_extent(at, centre, length)
    call find_bodies(parts, seams, bodies, n)
    unheld = 0.0_wp
    total = 0.0_wp
    do k = 1, n
      resultant = 0.0_wp
      amount = 0.0_wp
      do p = 1, size(at)
        list = reshape(forces(p)%values, [size(forces(p)%values)])
        do i = 1, size(list)
          if (.not. is_in_body(bodies(p), i, k)) cycle
          resultant = resultant + list(i)*row_of(at(p), i, centre, length)
          amount = amount + abs(list(i))
        end do
      end do
      resultant = remainder(taken_by_supports(at, bodies, k, centre, length, fixed), resultant)
      if (k > 1 .and. norm2(resultant)*total <= norm2(unheld)*amount) cycle
      unheld = resultant
      total = amount
    end do
  end subroutine find_unheld

  !> The motions along which such a resultant acts.
  pure function motions_along(unheld) result(words)
    real(wp), intent(in) :: unheld(6)
    character(:), allocatable :: words
    real(wp), parameter :: little = 1.0e-3_wp
    integer :: i

    words = ""
    do i = 1, 6
      if (abs(unheld(i)) <= little*maxval(abs(unheld))) cycle
      if (words /= "") words = words//", "
      words = words//trim(merge("rotation about", "motion in     ", i > 3))//" "// &
              axis_names(modulo(i - 1, 3) + 1)
    end do
  end function motions_along

  !> Which body each control point belongs to: patches with a common seam are one. A trim may leave
  !! several of a patch.
  pure subroutine find_bodies(parts, seams, bodies, n)
    type(part_t), intent(in) :: parts(:)
    type(seams_t), intent(in) :: seams
    type(body_of_t), intent(out) :: bodies(:)
    integer, intent(out) :: n
    integer :: group(size(parts)), p, g, i, first, other

    group = [(p, p=1, size(parts))]
    do g = 1, seams%n_groups
      do i = seams%first(g) + 1, seams%first(g + 1) - 1
        first = group(seams%patch(seams%first(g)))
        other = group(seams%patch(i))
        if (first == other) cycle
        where (group == max(first, other)) group = min(first, other)
      end do
    end do
    n = 0
    do p = 1, size(parts)
      if (group(p) /= p) cycle
      n = n + 1
      where (group == p) group = -n
    end do
    do p = 1, size(parts)
      associate (points => shape(parts(p)%element%mass))
        allocate (bodies(p)%number(points(1), points(2)), source=-group(p))
      end associate
    end do
    if (size(parts) == 1 .and. allocated(parts(1)%element%ties%is_free)) then
      call find_pieces(parts(1)%element, bodies(1)%number)
      n = maxval(bodies(1)%number)
    end if
  end subroutine find_bodies

  !> Number of the piece of a trimmed sheet that each control point moves with, 0 for those without
  !! motion of their own. Elements belong together that share a control point.
  pure subroutine find_pieces(element, piece)
    class(element_t), intent(in) :: element
    integer, allocatable, intent(out) :: piece(:, :)
    integer, allocatable :: of(:, :)                     ! elements
    integer, allocatable :: spans1(:), spans2(:)
    integer :: queue(2, product(element%n_elements(:2))), i, j, n, done, last, low(2), high(2)

    associate (share => element%ties%share, axes => element%grid%axes)
      spans1 = span_table(axes(1))
      spans2 = span_table(axes(2))
      allocate (of(size(share, 1), size(share, 2)), source=0)
      n = 0
      do j = 1, size(share, 2)
        do i = 1, size(share, 1)
          if (share(i, j) <= 0.0_wp .or. of(i, j) > 0) cycle
          n = n + 1
          of(i, j) = n
          queue(:, 1) = [i, j]
          done = 0
          last = 1
          do while (done < last)
            done = done + 1
            call add_neighbours(share, axes%degree, queue(:, done), n, of, queue, last)
          end do
        end do
      end do
      allocate (piece(size(element%ties%is_free, 1), size(element%ties%is_free, 2)), source=0)
      do j = 1, size(share, 2)
        do i = 1, size(share, 1)
          low = [spans1(i), spans2(j)] - axes(:2)%degree
          high = low + axes(:2)%degree
          if (of(i, j) > 0) piece(low(1):high(1), low(2):high(2)) = of(i, j)
        end do
      end do
      where (.not. element%ties%is_free) piece = 0
    end associate
  end subroutine find_pieces

  pure logical function is_leader(fixed, i)
    type(fixed_t), intent(in) :: fixed
    integer, intent(in) :: i

    is_leader = .true.
    if (allocated(fixed%leader)) is_leader = fixed%leader(i) == i
  end function is_leader

  !> Elements not met yet that share a control point with one.
  pure subroutine add_neighbours(share, degrees, at, number, of, queue, last)
    real(wp), intent(in) :: share(:, :)
    integer, intent(in) :: degrees(3), at(2), number
    integer, intent(inout) :: of(:, :), queue(:, :), last
    integer :: i, j

    do j = max(1, at(2) - degrees(2)), min(size(share, 2), at(2) + degrees(2))
      do i = max(1, at(1) - degrees(1)), min(size(share, 1), at(1) + degrees(1))
        if (share(i, j) <= 0.0_wp .or. of(i, j) > 0) cycle
        of(i, j) = number
        last = last + 1
        queue(:, last) = [i, j]
      end do
    end do
  end subroutine add_neighbours

  !> Does a control point move with a body? At the edge of an outline some follow others.
  pure logical function is_in_body(body, place, k)
    type(body_of_t), intent(in) :: body
    integer, intent(in) :: place                   !! of a component in the field as one list
    integer, intent(in) :: k
    integer :: layer

    associate (n => shape(body%number))
      layer = mod(place - 1, n(1)*n(2))
      is_in_body = body%number(mod(layer, n(1)) + 1, layer/n(1) + 1) == k
    end associate
  end function is_in_body

  pure subroutine hold(place, n, is_fixed)
    integer, intent(in) :: place, n(4)
    logical, intent(inout) :: is_fixed(product(n))

    is_fixed(place) = .true.
  end subroutine hold

  pure subroutine find_extent(at, centre, length)
    type(field_t), intent(in) :: at(:)
    real(wp), intent(out) :: centre(3), length
    real(wp) :: low(3), high(3)
    integer :: p, c

    low = huge(low)
    high = -huge(high)
    do p = 1, size(at)
      do c = 1, 3
        low(c) = min(low(c), minval(at(p)%values(:, :, :, c)))
        high(c) = max(high(c), maxval(at(p)%values(:, :, :, c)))
      end do
    end do
    centre = 0.5_wp*(low + high)
    length = max(norm2(high - low), tiny(length))
  end subroutine find_extent

  !> What the rigid motions move a component by: three translations, three rotations about the
  !! centre with their arms over the length.
  pure function row_of(field, place, centre, length) result(row)
    type(field_t), intent(in) :: field             !! positions
    integer, intent(in) :: place                   !! in the field as one list
    real(wp), intent(in) :: centre(3), length
    real(wp) :: row(6)

    row = rigid_row((place_of(field, place) - centre)/length, component_of(field, place))
  end function row_of

  pure integer function component_of(field, place) result(c)
    type(field_t), intent(in) :: field
    integer, intent(in) :: place

    c = (place - 1)/(size(field%values)/3) + 1
  end function component_of

  !> Position of the control point of a component.
  pure function place_of(field, place) result(x)
    type(field_t), intent(in) :: field
    integer, intent(in) :: place                   !! in the field as one list
    real(wp) :: x(3)

    x = vector_at(field%values, mod(place - 1, size(field%values)/3) + 1)
  end function place_of

  !> Components that are held, in words such as `z at 0, 0, 0`.
  function held_words(at, added) result(words)
    type(field_t), intent(in) :: at(:)             !! positions
    integer, intent(in) :: added(:, :)             !! see `hold_rigid_motions`
    character(:), allocatable :: words
    integer :: i

    words = ""
    do i = 1, size(added, 2)
      if (i > 1) words = words//"; "
      associate (field => at(added(1, i)), place => added(2, i))
        words = words//axis_names(component_of(field, place))//" at "// &
                place_text(place_of(field, place))
      end associate
    end do
  end function held_words

  pure function remainder(taken, row) result(rest)
    type(taken_t), intent(in) :: taken
    real(wp), intent(in) :: row(6)
    real(wp) :: rest(6)
    integer :: k, pass

    rest = row
    do pass = 1, 2
      do k = 1, taken%n
        rest = rest - dot_product(taken%basis(:, k), rest)*taken%basis(:, k)
      end do
    end do
  end function remainder

  pure subroutine take(taken, row)
    type(taken_t), intent(inout) :: taken
    real(wp), intent(in) :: row(6)
    real(wp) :: rest(6)

    if (taken%n == 6) return
    rest = remainder(taken, row)
    if (norm2(rest) <= least) return
    taken%n = taken%n + 1
    taken%basis(:, taken%n) = rest/norm2(rest)
  end subroutine take

end module rigid_supports
