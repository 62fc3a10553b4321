!> Draw beads as lines of force: they hold back sheet that is drawn across them.
!!
!! A bead acts on a band around a polyline. A point of the sheet at the distance d from the line
!! bears f phi(d) per area with phi = (1 + cos(pi d/b))/(2 b), whose integral across the band of
!! half-width b is one, so that f is the force per length of the line. It acts in the plane of the
!! sheet, across the line and against the motion there, through a spring that gives way at full
!! force: sheet at rest is held, and its motion along the line is free. What the bead takes from the
!! sheet counts as work of friction, the little that its springs hold included.
module draw_bead
  use kinds, only: wp
  use state_store, only: state_store_t, carry, carry_array
  use linear_algebra, only: cross
  use knot_vector, only: span_table, basis_derivatives
  use nurbs_surface, only: nurbs_surface_t
  use gauss_rule, only: gauss_rule_t, new_gauss_rule
  use tool, only: travel_of
  use blank, only: assembly_t
  use motion_curve, only: curve_value, start_curve
  use effect, only: effect_t, instant_t
  implicit none
  private

  public :: new_draw_bead, set_slip, is_on, find_spring

  real(wp), parameter :: pi = acos(-1.0_wp)

  !> A point of the sheet: what it takes to find its place, tangents and share of the area.
  type :: bead_point_t
    integer :: first(2) = 1                 ! first control point
    real(wp), allocatable :: basis(:, :)    ! rational basis functions
    real(wp), allocatable :: slope(:, :, :) ! their derivatives by both parameters
    real(wp) :: measure = 0.0_wp            ! quadrature weight in parameter space
  end type bead_point_t

  !> A bead against one face of a patch.
  type, extends(effect_t), public :: draw_bead_t
    integer :: part = 1                       !! patch of the blank
    integer :: face = 0                       !! of the patch
    real(wp), allocatable :: line(:, :)       !! corners of the polyline, (3, n) [length]
    real(wp) :: half_width = 0.0_wp           !! b [length]
    real(wp) :: restraint = 0.0_wp            !! f [force/length]
    real(wp) :: hold_down = 0.0_wp            !! push against the outward normal [force/length]
    real(wp) :: outward = 1.0_wp              !! sign that turns xi x eta outward
    real(wp) :: slip = 0.0_wp                 !! stretch of the springs at full force [length]
    integer :: closing = 0                    !! tool whose way the curve runs over, 0: the time
    type(bead_point_t), allocatable :: points(:)
    real(wp), allocatable :: stretch(:)       !! of the springs, -slip to slip, (n_points)
    real(wp) :: factor = 0.0_wp               !! of the curve at the last step
    real(wp) :: travel = 0.0_wp               !! bound of the motion of the sheet so far [length]
    real(wp), allocatable :: test_at(:)  !! travel at which a point may be in the band (n_points)
    real(wp), allocatable :: held(:, :, :)    !! restraint on the control points at the last step
    real(wp), allocatable :: pushed(:, :, :)  !! hold-down force there
  contains
    procedure :: apply
    procedure :: start
    procedure :: stop
    procedure :: carry => carry_bead
  end type draw_bead_t

contains

  !> Points of the face that the bead may act on; the caller sets line, forces and face.
  pure subroutine new_draw_bead(bead, face, name, share)
    type(draw_bead_t), intent(inout) :: bead
    type(nurbs_surface_t), intent(in) :: face     !! of the patch at the start
    character(*), intent(in) :: name
    real(wp), intent(in), optional :: share(:, :)    !! of the elements, inside an outline
    type(gauss_rule_t) :: rule(2)
    integer, allocatable :: spans1(:), spans2(:)
    integer :: e1, e2, g1, g2, n

    bead%name = name
    allocate (spans1, source=span_table(face%axes(1)))
    allocate (spans2, source=span_table(face%axes(2)))
    rule(1) = new_gauss_rule(face%axes(1)%degree + 1, 1)
    rule(2) = new_gauss_rule(face%axes(2)%degree + 1, 1)
    allocate (bead%points(size(spans1)*size(spans2)*rule(1)%n*rule(2)%n))
    n = 0
    do e2 = 1, size(spans2)
      do e1 = 1, size(spans1)
        do g2 = 1, rule(2)%n
          do g1 = 1, rule(1)%n
            n = n + 1
            call set_point(face, [spans1(e1), spans2(e2)], [rule(1)%points(g1), &
                           rule(2)%points(g2)], bead%points(n))
            bead%points(n)%measure = bead%points(n)%measure*rule(1)%weights(g1) &
                                     *rule(2)%weights(g2)
            if (present(share)) bead%points(n)%measure = share(e1, e2)*bead%points(n)%measure
          end do
        end do
      end do
    end do
    allocate (bead%stretch(n), source=0.0_wp)
    allocate (bead%test_at(n), source=0.0_wp)
    allocate (bead%held(size(face%weights, 1), size(face%weights, 2), 3), source=0.0_wp)
    allocate (bead%pushed, source=bead%held)
  end subroutine new_draw_bead

  !> Basis of one point; its measure is the size of the span in parameter space, over four.
  pure subroutine set_point(face, spans, place, point)
    type(nurbs_surface_t), intent(in) :: face
    integer, intent(in) :: spans(2)
    real(wp), intent(in) :: place(2)       !! in the element, -1 to 1
    type(bead_point_t), intent(out) :: point
    real(wp) :: low, high, xi, total, change(2)
    real(wp) :: one(face%axes(1)%degree + 1, 0:1), two(face%axes(2)%degree + 1, 0:1)
    integer :: d, i, j

    point%measure = 1.0_wp
    do d = 1, 2
      associate (axis => face%axes(d))
        low = axis%knots(spans(d))
        high = axis%knots(spans(d) + 1)
        xi = 0.5_wp*(low*(1 - place(d)) + high*(1 + place(d)))
        if (d == 1) call basis_derivatives(axis, spans(d), xi, 1, one)
        if (d == 2) call basis_derivatives(axis, spans(d), xi, 1, two)
        point%first(d) = spans(d) - axis%degree
        point%measure = 0.5_wp*(high - low)*point%measure
      end associate
    end do
    allocate (point%basis(size(one, 1), size(two, 1)))
    allocate (point%slope(size(one, 1), size(two, 1), 2))
    do j = 1, size(two, 1)
      do i = 1, size(one, 1)
        associate (w => face%weights(point%first(1) + i - 1, point%first(2) + j - 1))
          point%basis(i, j) = one(i, 0)*two(j, 0)*w
          point%slope(i, j, 1) = one(i, 1)*two(j, 0)*w
          point%slope(i, j, 2) = one(i, 0)*two(j, 1)*w
        end associate
      end do
    end do
    total = sum(point%basis)
    change = [sum(point%slope(:, :, 1)), sum(point%slope(:, :, 2))]
    point%basis = point%basis/total
    do d = 1, 2
      point%slope(:, :, d) = (point%slope(:, :, d) - point%basis*change(d))/total
    end do
  end subroutine set_point

  !> Whether the bead lies on its face at the start: a point of it may be in the band.
  pure logical function is_on(bead, face)
    type(draw_bead_t), intent(in) :: bead
    type(nurbs_surface_t), intent(in) :: face
    real(wp) :: place(3)
    integer :: p, c, i(2)

    is_on = .true.
    do p = 1, size(bead%points)
      associate (point => bead%points(p))
        if (.not. point%measure > 0.0_wp) cycle     ! outside of an outline
        i = point%first + shape(point%basis) - 1
        place = [(sum(point%basis*face%points(point%first(1):i(1), point%first(2):i(2), c)), &
                  c=1, 3)]
      end associate
      if (reach_of(bead%line, place) <= sqrt(2.0_wp)*bead%half_width) return
    end do
    is_on = .false.
  end function is_on

  !> Stretch at full force: as given, but not so small that the springs would lower the stable step.
  pure subroutine set_slip(bead, slip, mass_per_area, dt)
    type(draw_bead_t), intent(inout) :: bead
    real(wp), intent(in) :: slip             !! asked for [length]
    real(wp), intent(in) :: mass_per_area    !! of the sheet [mass/area]
    real(wp), intent(in) :: dt               !! of the steps [time]
    real(wp), parameter :: share = 0.1_wp    !! of the stiffness that a step bears
    real(wp) :: greatest

    greatest = bead%restraint*maxval(abs(bead%curve%values))/bead%half_width
    bead%slip = max(slip, greatest*dt**2/(share*mass_per_area))
  end subroutine set_slip

  !> Forces of this instant, and the work of the step that led here.
  subroutine apply(self, bodies, instant)
    class(draw_bead_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp), allocatable, dimension(:, :, :) :: x, v, held, pushed
    integer :: c

    allocate (x, v, held, pushed, mold=self%held)
    associate (body => bodies%blank%parts(self%part)%element)
      call body%look_at_faces()
      call body%face_net(self%face, x)
      call body%face_velocities(self%face, v)
      held = 0.0_wp
      pushed = 0.0_wp
      ! Where the curve of the forces stands: the way of the closing tool, or the time.
      if (self%closing > 0) then
        self%factor = curve_value(self%curve, norm2(travel_of(bodies%tools(self%closing))))
      else
        self%factor = curve_value(self%curve, instant%time)
      end if
      call add_forces(self, [size(x, 1), size(x, 2)], x, v, instant%dt, held, pushed)
      self%friction_energy = self%friction_energy - 0.5_wp*instant%dt*sum((self%held + held)*v)
      self%external_work = self%external_work + 0.5_wp*instant%dt*sum((self%pushed + pushed)*v)
      call body%add_face_forces(self%face, held)
      if (abs(self%hold_down) > 0.0_wp) call body%add_face_forces(self%face, pushed)
    end associate
    do c = 1, 3
      self%force(c) = sum(held(:, :, c)) + sum(pushed(:, :, c))
    end do
    call move_alloc(held, self%held)
    call move_alloc(pushed, self%pushed)
  end subroutine apply

  !> The curve begins with the step that names the bead; one over the way of a tool has no clock.
  subroutine start(self, time)
    class(draw_bead_t), intent(inout) :: self
    real(wp), intent(in) :: time

    if (self%closing == 0) call start_curve(self%curve, time)
  end subroutine start

  !> The bead opens.
  subroutine stop(self, bodies, dt)
    class(draw_bead_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: dt
    real(wp), allocatable :: v(:, :, :)

    allocate (v, mold=self%held)
    call bodies%blank%parts(self%part)%element%face_velocities(self%face, v)
    self%friction_energy = self%friction_energy - 0.5_wp*dt*sum(self%held*v)
    self%external_work = self%external_work + 0.5_wp*dt*sum(self%pushed*v)
    self%held = 0.0_wp
    self%pushed = 0.0_wp
    self%force = 0.0_wp
  end subroutine stop

  !> Forces of all points that may be in the band. The others are not looked at: a point at some
  !! distance from the band cannot be in it before the sheet has moved as far.
  pure subroutine add_forces(self, n, x, v, dt, held, pushed)
    class(draw_bead_t), intent(inout) :: self
    integer, intent(in) :: n(2)                         !! control points of the face
    real(wp), intent(in) :: x(n(1), n(2), 3), v(n(1), n(2), 3)
    real(wp), intent(in) :: dt
    real(wp), intent(inout) :: held(n(1), n(2), 3), pushed(n(1), n(2), 3)
    integer :: p

    self%travel = self%travel + dt*sqrt(maxval(sum(v**2, 3)))
    do p = 1, size(self%points)
      if (self%travel < self%test_at(p)) cycle
      associate (point => self%points(p))
        call work_point(self, p, point%first, shape(point%basis), point%basis, point%slope, n, x, &
                        v, dt, held, pushed)
      end associate
    end do
  end subroutine add_forces

  !> Force of one point; it notes when the point may come into the band.
  pure subroutine work_point(self, p, first, m, basis, slope, n, x, v, dt, held, pushed)
    class(draw_bead_t), intent(inout) :: self
    integer, intent(in) :: p, first(2), m(2), n(2)      !! m: basis functions each way
    real(wp), intent(in) :: basis(m(1), m(2)), slope(m(1), m(2), 2)
    real(wp), intent(in) :: x(n(1), n(2), 3), v(n(1), n(2), 3)
    real(wp), intent(in) :: dt
    real(wp), intent(inout) :: held(n(1), n(2), 3), pushed(n(1), n(2), 3)
    real(wp) :: speed(3), normal(3), across(3), band, reach
    integer :: i, j

    call find_band(self, p, first, m, basis, slope, n, x, reach, normal, across, band)
    self%test_at(p) = self%travel + max(reach, 0.0_wp)
    if (band < 0.0_wp) then
      self%stretch(p) = 0.0_wp
      return
    end if
    speed = 0.0_wp
    do j = 1, m(2)
      do i = 1, m(1)
        speed = speed + basis(i, j)*v(first(1) + i - 1, first(2) + j - 1, :)
      end do
    end do
    self%stretch(p) = min(max(self%stretch(p) + dt*dot_product(speed, across), -self%slip), &
                          self%slip)
    call spread_force(first, m, basis, -self%restraint*band*(self%stretch(p)/self%slip)*across, n, &
                      held)
    if (abs(self%hold_down) > 0.0_wp) &
      call spread_force(first, m, basis, -self%hold_down*band*normal, n, pushed)
  end subroutine work_point

  !> Where a point lies in the band.
  pure subroutine find_band(self, p, first, m, basis, slope, n, x, reach, normal, across, band)
    class(draw_bead_t), intent(in) :: self
    integer, intent(in) :: p, first(2), m(2), n(2)
    real(wp), intent(in) :: basis(m(1), m(2)), slope(m(1), m(2), 2), x(n(1), n(2), 3)
    real(wp), intent(out) :: reach            !! how far it is from where it might be in the band
    real(wp), intent(out) :: normal(3), across(3)   !! of the sheet; across the line
    real(wp), intent(out) :: band             !! phi times its area and the curve [length]; negative
                                              !! where it is not in it
    real(wp) :: place(3), d1(3, 2), distance, area
    integer :: i, j, k, l

    normal = 0.0_wp
    across = 0.0_wp
    band = -1.0_wp
    place = 0.0_wp
    do j = 1, m(2)
      do i = 1, m(1)
        place = place + basis(i, j)*x(first(1) + i - 1, first(2) + j - 1, :)
      end do
    end do
    reach = reach_of(self%line, place) - sqrt(2.0_wp)*self%half_width
    if (reach > 0.0_wp) return
    d1 = 0.0_wp
    do j = 1, m(2)
      do i = 1, m(1)
        k = first(1) + i - 1
        l = first(2) + j - 1
        d1(:, 1) = d1(:, 1) + slope(i, j, 1)*x(k, l, :)
        d1(:, 2) = d1(:, 2) + slope(i, j, 2)*x(k, l, :)
      end do
    end do
    normal = cross(d1(:, 1), d1(:, 2))
    area = norm2(normal)
    normal = self%outward*normal/area
    call place_by_line(self%line, place, normal, across, distance)
    if (distance < self%half_width) &
      band = self%factor*area*self%points(p)%measure*(1 + cos(pi*distance/self%half_width)) &
             /(2*self%half_width)
  end subroutine find_band

  !> The spring of a point as the last step left it: at full stretch it gives way and has none.
  pure subroutine find_spring(self, p, x, across, stiffness)
    class(draw_bead_t), intent(in) :: self
    integer, intent(in) :: p
    real(wp), intent(in) :: x(:, :, :)        !! control points of the face (n1, n2, 3)
    real(wp), intent(out) :: across(3)        !! its direction
    real(wp), intent(out) :: stiffness        !! [force/length]
    real(wp) :: normal(3), reach, band

    stiffness = 0.0_wp
    across = 0.0_wp
    if (abs(self%stretch(p)) >= self%slip) return
    associate (point => self%points(p))
      call find_band(self, p, point%first, shape(point%basis), point%basis, point%slope, &
                     [size(x, 1), size(x, 2)], x, reach, normal, across, band)
    end associate
    stiffness = self%restraint*max(band, 0.0_wp)/self%slip
  end subroutine find_spring

  pure subroutine spread_force(first, m, basis, force, n, net)
    integer, intent(in) :: first(2), m(2), n(2)
    real(wp), intent(in) :: basis(m(1), m(2)), force(3)
    real(wp), intent(inout) :: net(n(1), n(2), 3)
    integer :: i, j

    do j = 1, m(2)
      do i = 1, m(1)
        associate (values => net(first(1) + i - 1, first(2) + j - 1, :))
          values = values + basis(i, j)*force
        end associate
      end do
    end do
  end subroutine spread_force

  pure real(wp) function reach_of(line, place) result(reach)
    real(wp), intent(in) :: line(:, :), place(3)
    real(wp) :: along(3), share, square
    integer :: s

    square = huge(1.0_wp)
    do s = 1, size(line, 2) - 1
      along = line(:, s + 1) - line(:, s)
      share = min(max(dot_product(place - line(:, s), along)/sum(along**2), 0.0_wp), 1.0_wp)
      square = min(square, sum((place - line(:, s) - share*along)**2))
    end do
    reach = sqrt(square)
  end function reach_of

  !> Nearest place of a polyline: unit vector across it in the plane of the sheet, whose sense is
  !! that of normal x line, and distance in that plane, which is huge beyond the line's ends.
  pure subroutine place_by_line(line, place, normal, across, distance)
    real(wp), intent(in) :: line(:, :), place(3), normal(3)
    real(wp), intent(out) :: across(3), distance
    real(wp) :: along(3), arm(3), share, length, reach
    logical :: is_beyond
    integer :: s

    across = 0.0_wp
    distance = huge(1.0_wp)
    reach = huge(1.0_wp)
    is_beyond = .false.
    do s = 1, size(line, 2) - 1
      along = line(:, s + 1) - line(:, s)
      length = norm2(along)
      share = dot_product(place - line(:, s), along)/length**2
      arm = place - line(:, s) - min(max(share, 0.0_wp), 1.0_wp)*along
      if (norm2(arm) >= reach) cycle
      reach = norm2(arm)
      is_beyond = (s == 1 .and. share < 0.0_wp) .or. &
                  (s == size(line, 2) - 1 .and. share > 1.0_wp)
      arm = arm - dot_product(arm, normal)*normal
      distance = norm2(arm)
      across = cross(normal, along)/length
      if ((share < 0.0_wp .or. share > 1.0_wp) .and. distance > 0.0_wp) then
        ! Around a corner of the line the way out from the corner is across.
        across = arm*sign(1.0_wp/distance, dot_product(arm, across))
      end if
      across = across/max(norm2(across), tiny(1.0_wp))
    end do
    if (is_beyond) distance = huge(1.0_wp)
  end subroutine place_by_line

  subroutine carry_bead(self, store)
    class(draw_bead_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    call carry(store, "lost", self%friction_energy)
    call carry_array(store, "stretch", size(self%stretch), self%stretch)
    call carry_array(store, "held", size(self%held), self%held)
    call carry_array(store, "pushed", size(self%pushed), self%pushed)
    if (.not. store%is_taking) return
    self%travel = 0.0_wp      ! which points are near is found anew
    self%test_at = 0.0_wp
  end subroutine carry_bead

end module draw_bead
